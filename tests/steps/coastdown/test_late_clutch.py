"""A clutch that drags at the start of every run is cut from all; nothing is of a fading brake or a clean day."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.messy_cases import prepared
from tests.plant import messy_day
from vdyn_cli.description.description_model import Segment
from vdyn_cli.steps.coastdown.coasts.selection import selected

DAY = messy_day.Day(rms=0.0005, upper=30.0, lower=8.0)


def cuts(day: messy_day.Day, seed: int) -> tuple[float, ...]:
    """s that are cut at the start of each run."""
    found = prepared(messy_day.drive(seed, day), False).problem.selection.rejected  # type: ignore[attr-defined]
    return tuple(r.stop - r.start for r in found if "all runs" in r.why)


def test_a_clutch_that_drags_in_all_runs_is_cut_from_all() -> None:
    found = cuts(replace(DAY, late_clutch=4.0), 51)
    assert len(found) == 8
    assert all(4.0 <= s <= 8.0 for s in found)


@pytest.mark.parametrize("release", [1.2, 2.0, 3.0])
@pytest.mark.parametrize("rate", [5.0, 20.0])
def test_a_clutch_that_drags_shortly_is_cut_soon_after(release: float, rate: float) -> None:
    day = replace(DAY, rms=0.001, late_clutch=release, logger=messy_day.Logger(rate=rate))
    case = messy_day.drive(54, day)
    segments = prepared(case, False).problem.selection.segments  # type: ignore[attr-defined]
    begins = [float(s.log.time[0]) for s in segments]
    assert len(begins) == 8
    assert all(0.95 * release <= begin <= 1.35 * release + 1.0 / rate for begin in begins)


def test_a_clutch_that_slips_softly_is_cut_until_it_is_gone() -> None:
    found = cuts(replace(DAY, brake=350.0, brake_time=1.0), 55)
    assert len(found) == 8
    assert all(2.0 <= s <= 5.0 for s in found)


@pytest.mark.parametrize(
    "day",
    [
        DAY,
        replace(DAY, rms=0.003),
        replace(DAY, brake=180.0, brake_time=15.0),
        replace(DAY, brake=350.0, brake_time=5.0),
    ],
    ids=["clean", "road", "fading", "fading soon"],
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
