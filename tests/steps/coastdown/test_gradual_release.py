"""A deceleration that sets in gradually after a held speed is found in all runs together, and an abrupt one is not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.steps.coastdown.test_held_speed import STEP, driven
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.filtered_start import without_filtered_start
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, coast_segment

HELD = 8.0  # s


def logs(lag: float, rate: float = 20.0, noise: float = 0.04, wander: float = 0.1) -> list[Log]:
    """Eight coasts after a held speed, logged through a first-order filter of time constant ``lag`` s."""
    rng, found = np.random.default_rng(8), []
    for _ in range(8):
        fine, speed = driven(5.0, HELD, wander, rng)
        passed = speed.copy()
        for k in range(1, passed.size if lag else 0):
            passed[k] = passed[k - 1] + (speed[k] - passed[k - 1]) * STEP / (lag + STEP)
        time = np.arange(0.0, 60.0, 1.0 / rate)
        found.append(Log("run", time, {"speed": np.interp(time, fine, passed) + noise * rng.normal(size=time.size)}))
    return found


def cuts(whole: list[Log]) -> list[float]:
    """s after the release up to which the start of each coast is cut."""
    coasts = [coast_segment(k, log, None, 8.0) for k, log in enumerate(whole)]
    segments = [one for one in coasts if isinstance(one, CoastSegment)]
    rejected = without_filtered_start(segments)[1]
    return [r.stop - 5.0 - HELD for r in rejected if "sets in" in r.why]


@pytest.mark.parametrize(("lag", "wander"), [(0.8, 0.03), (2.0, 0.1)])
def test_a_filtered_speed_is_cut_until_its_deceleration_is_complete(lag: float, wander: float) -> None:
    found = cuts(logs(lag, wander=wander))
    assert len(found) == 8
    assert all(3.0 * lag < cut < 5.0 * lag for cut in found)


@pytest.mark.parametrize(("rate", "noise", "wander"), [(20.0, 0.04, 0.1), (100.0, 0.02, 0.02), (2.0, 0.1, 0.1)])
def test_an_abrupt_release_is_not_cut(rate: float, noise: float, wander: float) -> None:
    assert cuts(logs(0.0, rate, noise, wander)) == []
