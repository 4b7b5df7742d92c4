"""The start of coasts whose speed is filtered is cut from all; other starts are not, and what must be kept is not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.filtered_start import filter_lag

FILTERED = messy_day.Logger(rate=20.0, smooth=0.5, noise=0.01)
DAY = messy_day.Day(rms=0.0005, upper=33.0, lower=20.0, runs=6, logger=FILTERED)


def lag(day: messy_day.Day, seed: int) -> float | None:
    runs = messy_day.drive(seed, day).runs
    return filter_lag([Log(f"run_{k}.csv", r.time, {"speed": r.speed}) for k, r in enumerate(runs)])


@pytest.mark.parametrize("smooth", [0.3, 0.5, 1.0])
def test_the_lag_of_a_filtered_speed_is_found(smooth: float) -> None:
    found = lag(replace(DAY, logger=replace(FILTERED, smooth=smooth)), 61)
    assert found is not None
    assert 0.7 * smooth < found < 1.3 * smooth


@pytest.mark.parametrize(
    "day",
    [
        replace(DAY, logger=messy_day.Logger()),
        replace(DAY, logger=messy_day.Logger(rate=50.0, held=5.0)),
        replace(DAY, logger=messy_day.Logger(), late_clutch=2.0),
        replace(DAY, logger=messy_day.Logger(), brake=180.0, brake_time=15.0),
        replace(DAY, logger=messy_day.Logger(rate=1.0)),
    ],
    ids=["plain", "held", "clutch", "fading", "slow"],
)
def test_other_starts_show_none(day: messy_day.Day) -> None:
    assert lag(day, 62) is None


def test_the_start_is_cut_and_said() -> None:
    problem = prepared(messy_day.drive(63, DAY), False).problem
    cut = [r for r in problem.selection.rejected if "lags by" in r.why]  # type: ignore[attr-defined]
    assert len(cut) == 6
    assert all(1.4 < r.stop - r.start < 2.6 for r in cut)
