"""A clutch that drags at the start of every run is cut from all; a fading brake and a clean day are not."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.description.test_description import Segment
from vdyn_cli.steps.coastdown.selection import selected

DAY = messy_day.Day(rms=0.0005, upper=30.0, lower=8.0)


def cuts(day: messy_day.Day, seed: int) -> tuple[float, ...]:
    """s that are cut at the start of each run."""
    found = prepared(messy_day.drive(seed, day), False).problem.selection.rejected  # type: ignore[attr-defined]
    return tuple(r.stop - r.start for r in found if "all runs" in r.why)


def test_a_clutch_that_drags_in_all_runs_is_cut_from_all() -> None:
    found = cuts(replace(DAY, late_clutch=4.0), 51)
    assert len(found) == 8
    assert all(4.0 <= s <= 8.0 for s in found)


@pytest.mark.parametrize(
    "day", [DAY, replace(DAY, rms=0.003), replace(DAY, brake=180.0, brake_time=15.0)], ids=["clean", "road", "fading"]
)
def test_other_days_are_not_cut(day: messy_day.Day) -> None:
    assert not cuts(day, 52)


def test_what_the_description_keeps_is_not_cut() -> None:
    case = messy_day.drive(53, replace(DAY, late_clutch=4.0))
    problem = prepared(case, False).problem
    spec, logs = problem.spec, problem.logs  # type: ignore[attr-defined]
    keep = Segment.model_validate({"channel": "speed", "from": "0 s", "to": "9 s"})
    spec = spec.model_copy(update={"runs": [r.model_copy(update={"keep": [keep]}) for r in spec.runs]})
    values = problem.campaign.values  # type: ignore[attr-defined]
    known = {n: type("Value", (), {"value": values[n]}) for n in ("mass", "rotating_mass")}
    rejected = selected(spec, logs, "coasting", known).rejected  # type: ignore[arg-type]
    assert not any("all runs" in r.why for r in rejected)
