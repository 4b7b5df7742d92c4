"""The recovery bench itself: its descriptions are accepted, and its table says what it should."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest

from tests.bench.recovery import CASES, Report, Trial, merged, run, section
from vdyn_cli.steps import names

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


@pytest.mark.parametrize("name", [name for name, case in CASES.items() if case.step in names()])
def test_each_case_gives_its_parameters_for_the_first_vehicle(name: str) -> None:
    report = run(name, CASES[name], vehicles=1, first=1)
    assert not report.refused
    assert all(abs(trial.value - trial.truth) < 6 * trial.bound for trial in report.trials)


def _report(bias: float, stretch: float) -> Report:
    rng = np.random.default_rng(1)
    trials = [
        Trial("mass", 1, 100.0, 1.0, value := 100.0 + stretch * e + bias, 1.0, (value - 2.0, value + 2.0))
        for e in rng.standard_normal(4000)
    ]
    return Report("tire", 4000, tuple(trials), Counter({"too few samples": 3}), 0.1)


def test_a_good_step_gets_a_plain_row_and_a_bad_one_a_bold_one() -> None:
    good = section(_report(0.0, 1.0), CASES["tire"])
    assert "| mass | 1 % | 1.0" in good
    assert "| 95 % | 1.0" in good
    assert "**3 of 4000**: too few samples" in good
    (row,) = [line for line in section(_report(1.0, 1.5), CASES["tire"]).splitlines() if line.startswith("| mass")]
    assert row.count("**") == 6


def test_the_page_keeps_the_sections_that_did_not_run() -> None:
    page = merged("", {"tire": "## tire\n\nbefore\n", "cg": "## cg\n\nkept\n"})
    page = merged(page, {"tire": "## tire\n\nafter\n"})
    assert "before" not in page
    assert page.index("kept") < page.index("after")
    assert merged(page, {}) == page
