"""A short braking at the end of every run is cut off, and the ends of other runs are not."""

from __future__ import annotations

import numpy as np
import pytest

from tests.messy_cases import prepared
from tests.plant.messy_day import Case, Day, Logger, Run, drawn_day, drive


def ending(case: Case, duration: float, brake: float = 2.5) -> Case:
    """Each run braked in its last ``duration`` seconds."""
    runs = []
    for run in case.runs:
        speed = run.speed - brake * np.clip(run.time - run.time[-1] + duration, 0.0, None)
        keep = speed > 0.3
        runs.append(Run(run.time[keep], speed[keep], run.position[keep], run.direction, run.start))
    return Case(case.vehicle, case.day, tuple(runs))


def cut_off(case: Case) -> list[float]:
    """The durations, s, of what is left out as braked at the end."""
    problem = prepared(case, position=False).problem
    return [r.stop - r.start for r in problem.selection.rejected if "brake or" in r.why]  # type: ignore[attr-defined]


@pytest.mark.parametrize(("duration", "rate"), [(0.9, 20.0), (1.7, 20.0), (2.6, 20.0), (2.6, 1.0)])
def test_a_short_braking_at_the_end_is_left_out(duration: float, rate: float) -> None:
    case = drive(3, Day(runs=4, lower=8.0, logger=Logger(rate=rate, noise=0.05)))
    left_out = cut_off(ending(case, duration))
    assert len(left_out) == len(case.runs)
    assert max(left_out) < 6.5 + 1.0 / rate


@pytest.mark.parametrize(
    "kind", ["clean", *(pytest.param(k, marks=pytest.mark.slow) for k in ("undulating", "quantized", "filtered"))]
)
def test_other_ends_are_kept(kind: str) -> None:
    assert cut_off(drive(7, drawn_day(kind, 7))) == []


@pytest.mark.parametrize("rate", [1.0, 2.0, 100.0])
def test_coarse_or_noisy_speeds_are_kept(rate: float) -> None:
    assert cut_off(drive(8, Day(runs=4, logger=Logger(rate=rate, noise=0.3)))) == []
