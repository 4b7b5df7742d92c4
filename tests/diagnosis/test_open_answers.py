"""Which results the intervals include that the step states beside its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import pytest

from vdyn_cli.diagnosis.extend.interval_union import OpenAnswer
from vdyn_cli.diagnosis.extend.open_answers import _Widening
from vdyn_cli.quantities.parameters import BASELINE, Parameters
from vdyn_cli.quantities.result import FitSummary, Result


def named(title: str) -> Result:
    fit = FitSummary(runs=2, rms=0.1, unit="m/s", noise_floor=0.1, unknowns=("drag_area",))
    return Result("coastdown", title, Parameters({}), fit, "")


class Spanned:
    """A problem that records the results that it spans."""

    def __init__(self) -> None:
        self.answers: list[str] = []

    def spanning(self, result: Result, answers: Sequence[Result]) -> Result:
        self.answers = [a.sentence for a in answers]
        return result


@pytest.mark.parametrize("open_baseline", [True, False])
def test_the_baseline_is_included_only_where_it_is_an_answer(open_baseline: bool) -> None:
    problem: Any = Spanned()
    strategy: Any = None
    answers = [OpenAnswer("headwind", {}), *([OpenAnswer(BASELINE, {})] if open_baseline else [])]
    _Widening(strategy, problem, named("base"), named("slope")).including(answers, [named("slope and headwind")])
    assert problem.answers == [*(["base"] if open_baseline else []), "slope and headwind"]
