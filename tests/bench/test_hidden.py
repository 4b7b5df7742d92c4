"""The hidden-effect bench: a fixed part of its matrix, and that it scores answers as it says."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.bench.hidden_cases import CASES, Cell
from tests.bench.hidden_log import recalled, remember
from tests.bench.hidden_table import alone, covered, found, gained, merged, not_wrong, quiet, section
from tests.bench.hidden_trial import Size, Trial, judged, run

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries

SEED = 3001
FAST = [cell for cell in CASES if cell.fast]


@pytest.mark.parametrize(
    "cell",
    [
        pytest.param(cell, marks=pytest.mark.thorough if cell.step in ("bump", "cg", "inertia", "shaft") else ())
        for cell in FAST
    ],
    ids=lambda cell: cell.name,
)
def test_a_hidden_effect_is_found(cell: Cell) -> None:
    trial = run(cell, SEED, strengths=False)
    assert judged(cell, trial) == "right", trial
    assert all(abs(size.value - size.true) < 2 * (size.high - size.low) for size in trial.sizes)


def _trial(verdict: str, *named: str, among: tuple[str, ...] = (), t: float = 10.0, least: float = 10.0) -> Trial:
    return Trial(
        1,
        {"headwind": t},
        {"headwind": least},
        verdict,
        frozenset(named),
        tuple(frozenset(answer.split("+")) for answer in among),
        (Size("headwind", 1.0, 1.1, 0.9, 1.3),) if "headwind" in named else (),
        (0.4, 0.3, 0.5) if named else None,
        0.45 if named else None,
    )


HEADWIND = Cell("coastdown", "wide", {"headwind": 1.0}, "named")
CLASS = Cell("coastdown", "fixed", {"headwind": 1.0}, "class")
PAIR = Cell("coastdown", "wide", {"headwind": 1.0, "road_grade": 1e-3}, "both")
NOTHING = Cell("coastdown", "wide", {}, "nothing")
UNLISTED = Cell("coastdown", "wide", {"drag_bump": 20.0}, "unknown")
UNSEEN = Cell("coastdown", "wide", {"brake_drag": 20.0}, "not_testable")
BROKEN = Cell("coastdown", "wide", {}, "fault", "stuck")


@pytest.mark.parametrize(
    ("cell", "trial", "score"),
    [
        (HEADWIND, _trial("named", "headwind"), "right"),
        (HEADWIND, _trial("data_fault", "headwind"), "right"),
        (HEADWIND, _trial("named", "road_grade"), "wrong"),
        (HEADWIND, _trial("named", "headwind", "road_grade"), "wrong"),
        (HEADWIND, _trial("ambiguous", among=("headwind", "road_grade")), "set"),
        (HEADWIND, _trial("ambiguous", among=("headwind+road_grade", "road_grade")), "wrong"),
        (HEADWIND, _trial("unknown"), "unknown"),
        (HEADWIND, _trial("adequate"), "silent"),
        (HEADWIND, _trial("refused"), "refused"),
        (CLASS, _trial("ambiguous", among=("headwind", "road_grade")), "right"),
        (CLASS, _trial("named", "headwind"), "guess"),
        (PAIR, _trial("named", "headwind", "road_grade"), "right"),
        (PAIR, _trial("ambiguous", among=("headwind+road_grade", "headwind+brake_drag")), "set"),
        (PAIR, _trial("named", "headwind"), "part"),
        (NOTHING, _trial("adequate"), "right"),
        (NOTHING, _trial("unknown"), "alarm"),
        (NOTHING, _trial("data_fault", "speed_scale"), "alarm"),
        (UNLISTED, _trial("unknown"), "right"),
        (UNLISTED, _trial("named", "headwind"), "wrong"),
        (UNSEEN, _trial("not_testable"), "right"),
        (UNSEEN, _trial("named", "headwind"), "alarm"),
        (BROKEN, _trial("refused"), "right"),
        (BROKEN, _trial("adequate"), "silent"),
        (BROKEN, _trial("crashed"), "crashed"),
    ],
)
def test_answers_are_judged_by_what_was_hidden(cell: Cell, trial: Trial, score: str) -> None:
    assert judged(cell, trial) == score


def test_rates_count_only_what_the_logs_can_show() -> None:
    rows = [
        (
            HEADWIND,
            [
                _trial("named", "headwind"),
                _trial("adequate", t=3.0, least=3.0),
                _trial("ambiguous", among=("headwind", "road_grade"), least=2.0),
                _trial("named", "road_grade"),
            ],
        )
    ]
    assert (found(rows).good, found(rows).of) == (2, 3)
    assert (alone(rows).good, alone(rows).of) == (1, 2)
    assert (not_wrong(rows).good, not_wrong(rows).of) == (3, 4)
    assert found(rows).short
    assert (covered(rows).good, covered(rows).of) == (1, 1)
    assert (gained(rows).good, gained(rows).of) == (2, 2)
    assert (quiet([(NOTHING, [_trial("adequate"), _trial("unknown")])]).good) == 1


def test_the_table_lists_what_falls_short_and_keeps_the_other_sections() -> None:
    text = section("coastdown", [(HEADWIND, [_trial("named", "road_grade")] * 3), (NOTHING, [_trial("adequate")])])
    assert "Falls short" in text
    assert "road_grade (3)" in text
    assert "**0/3**" in text
    good = section("cg", [(NOTHING, [_trial("adequate")])])
    assert "Falls short" not in good
    page = merged(merged("", {"coastdown": text, "cg": good}), {"cg": good})
    assert page.index("## coastdown") < page.index("## cg")
    assert page.count("## cg") == 1


def test_a_long_run_goes_on_where_it_was_stopped(tmp_path: Path) -> None:
    log = tmp_path / "trials.jsonl"
    assert recalled(log) == {}
    trials = {HEADWIND: _trial("named", "headwind"), PAIR: _trial("ambiguous", among=("headwind+road_grade", "wind"))}
    for cell, trial in trials.items():
        remember(log, cell, trial)
    assert recalled(log) == {(cell.name, 1): trial for cell, trial in trials.items()}


def test_the_page_shows_the_trials_of_validate_that_are_kept() -> None:
    known = recalled(Path(__file__).with_name("hidden_validate.jsonl"))
    cells = [cell for cell in CASES if cell.step == "validate"]
    seeds = sorted({seed for _, seed in known})
    rows = [(cell, [known[cell.name, seed] for seed in seeds if (cell.name, seed) in known]) for cell in cells]
    assert section("validate", rows) in Path(__file__).with_name("hidden.md").read_text(encoding="utf-8")
