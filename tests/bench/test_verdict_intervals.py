"""The bench of intervals beside a verdict: a fixed part of it, and that it counts as it says."""

from __future__ import annotations

import pytest

from tests.bench.verdict_intervals import CLAIMS, Outcome, Row, line, outcome, table

SEED = 7001
LEARNED, GAIN = Row("inertia", "", {"drag_bump": 10.0}), Row("inertia", "", {"hub_torque_gain": 0.005})


@pytest.mark.slow  # whole diagnoses
@pytest.mark.thorough
@pytest.mark.parametrize("row", [LEARNED, GAIN], ids=lambda row: row.name)
def test_what_is_claimed_covers_the_truth(row: Row) -> None:
    found = outcome(row, SEED)
    assert found.verdict in CLAIMS
    assert all(found.covered.values())
    if row is GAIN:  # the interval of the fit alone does not
        assert not all(found.alone.values())


@pytest.mark.slow
def test_a_trivial_error_is_no_alarm() -> None:
    assert outcome(Row("inertia", "", {"drag_bump": 0.1}, trivial=True), SEED).verdict == "adequate"


def test_only_open_verdicts_count() -> None:
    row = Row("coastdown", "wide", {"drag_bump": 25.0})
    good = Outcome("unknown", {"a": True, "b": True}, {"a": False, "b": True}, {"a": 3.0, "b": 2.0})
    bad = Outcome("ambiguous", {"a": False}, {"a": False}, {"a": 1.0})
    text = line(row, [good, bad, Outcome("named")])
    assert "ambiguous 1, named 1, unknown 1 | **2/3** | 1/3 | 2.0 |" in text
    small = Row("coastdown", "wide", {"headwind": 0.03}, trivial=True)
    page = table([(row, [good]), (small, [Outcome("adequate"), Outcome("named")])], 1, 1)
    assert "| all | | 2/2 | 1/2 | 2.5 | 1/2 |" in page
