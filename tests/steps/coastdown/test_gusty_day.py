"""Gusts on a light car with much drag are no brakes and no throttles, and a brake on such a day is found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.braking import without_braking
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, RejectedSegment, coast_segment

INERTIA, STEP = 1050.0, 0.05  # kg, s


def rejected(
    gust: float, seed: int, pulse: float = 0.0, stated: tuple[str, ...] = ("out", "back") * 4, wind: float = 1.0
) -> list[RejectedSegment]:
    """What is left out of eight coasts from 50 to 11 m/s in gusts (m/s, standard deviation, 6 s correlated).

    ``pulse`` m/s^2: of the third run, braked (positive) or driven between 10 and 16 s. ``stated``: directions.
    ``wind`` m/s: headwind on the way out.
    """
    rng, segments = np.random.default_rng(seed), []
    for k in range(8):
        head, speed, dv, trace = wind * (1 - 2 * (k % 2)), 50.0, gust * rng.normal(), []
        while speed > 11.0:
            dv += STEP / 6.0 * -dv + gust * np.sqrt(2.0 * STEP / 6.0) * rng.normal()
            force = 0.5 * 1.17 * 1.15 * (speed + head + dv) ** 2 + 134.0
            there = k == 2 and 10.0 < STEP * len(trace) < 16.0
            trace.append(speed)
            speed -= STEP * (force / INERTIA + there * pulse)
        read = np.array(trace) + rng.normal(0.0, 0.03, len(trace))
        one = coast_segment(k, Log(f"run_{k}.csv", STEP * np.arange(read.size), {"speed": read}), None, 5.0)
        assert isinstance(one, CoastSegment)
        segments.append(replace(one, direction=stated[k]))
    return without_braking(segments, None, 5.0)[1]


@pytest.mark.parametrize("seed", range(3))
def test_gusts_at_high_speed_are_not_cut(seed: int) -> None:
    assert not rejected(1.3, seed)


@pytest.mark.parametrize(("pulse", "cause"), [(0.5, "brake or driveline"), (-0.5, "throttle")])
def test_a_brake_or_a_throttle_in_gusts_is_cut_and_the_wind_is_named(pulse: float, cause: str) -> None:
    found = rejected(0.6, 1, pulse)
    assert {r.run for r in found} == {"run_2.csv"}
    assert all(cause in r.why for r in found)


def test_wind_is_named_where_it_could_be_the_cause() -> None:
    (found,) = rejected(0.2, 1, -0.25)
    assert "(throttle, or" in found.why
    assert "m/s more tailwind?)" in found.why


def test_a_run_stated_against_its_direction_is_not_called_braked_only() -> None:
    found = rejected(0.3, 1, stated=("out", "back", "back", "back", "out", "back", "out", "back"), wind=2.5)
    assert {r.run for r in found} == {"run_2.csv"}
    assert all("decelerates like the runs of direction 'out'" in r.why for r in found)
