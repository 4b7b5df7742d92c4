"""Which share of a grade the motion of coasts and drives shows, with runs that are braked at the same place."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.road.grade_agreement import shown_share

STEP = 0.1  # s


def coasts(true_share: float, braked: float, push: float = 0.0) -> list[RoadRun]:
    """Six coasts of 100 s on hills of ``true_share`` of their grade, braked by ``braked`` m/s^2 in their last 8 s.

    ``push``: N, mean of a drive force that varies over 44 s, of a vehicle of 1500 kg.
    """
    rng = np.random.default_rng(8)
    time = np.arange(0.0, 100.0, STEP)
    found = []
    for k in range(6):
        grade = 0.004 * np.sin(time / 15.0 + rng.uniform(0.0, 6.0)) + np.where(time > 92.0, 0.006, 0.0)
        force = push * (1.0 + np.sin(time / 7.0 + k))
        speed, last = np.empty(time.size), 28.0
        for i, t in enumerate(time):
            speed[i] = last
            slows = 0.1 + 3e-4 * last**2 + 9.81 * true_share * grade[i] + (braked if t > 92.0 else 0.0)
            last = max(last + (force[i] / 1500.0 - slows) * STEP, 0.0)
        part = np.zeros(time.size, dtype=np.int64)
        speed += 0.02 * rng.standard_normal(time.size)
        found.append(RoadRun(f"run_{k}", time, speed, {"grade": grade, "drive_force": force}, part))
    return found


@pytest.mark.parametrize("braked", [0.0, 1.2])
@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_brake_at_the_end_of_every_run_is_no_slope(share: float, braked: float) -> None:
    found = shown_share(coasts(share, braked))
    assert found is not None
    assert found[0] == pytest.approx(share, abs=0.05)
    assert found[1] < 0.05


@pytest.mark.parametrize("share", [0.0, 1.0])
def test_a_measured_drive_shows_the_share_of_driven_runs(share: float) -> None:
    found = shown_share(coasts(share, 0.0, push=300.0), "force")
    assert found is not None
    assert found[0] == pytest.approx(share, abs=0.05)
    assert found[1] < 0.05
