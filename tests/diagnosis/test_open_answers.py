"""Which results the intervals include that the step states beside its parameters."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from tests.diagnosis.linear import WAVE, WIND, Campaign
from vdyn_cli.diagnosis.extend.extension import _without_baseline
from vdyn_cli.diagnosis.extend.interval_union import OpenAnswer
from vdyn_cli.diagnosis.extend.open_answers import _Widening, by_fit, least_doubtful, with_other_forms
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.parameters import BASELINE, Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result


def named(title: str) -> Result:
    fit = FitSummary(runs=2, rms=0.1, unit="m/s", noise_floor=0.1, unknowns=("drag_area",))
    return Result("coastdown", title, Parameters({}), fit, "")


@pytest.mark.parametrize(("std", "excluded"), [(0.1, True), (0.3, False)])
def test_sets_of_effects_far_from_zero_exclude_the_baseline(std: float, excluded: bool) -> None:
    """As single effects do: one amplitude of 6 standard errors in every answer suffices."""
    values, stds = {"wind": 1.0, "wave": 0.1}, {"wind": std, "wave": 0.1}
    ends = {n: (v - 2 * stds[n], v + 2 * stds[n]) for n, v in values.items()}
    fitted: Any = SimpleNamespace(solution=SimpleNamespace(values=values, std=stds, interval95=ends))
    answers = tuple(CandidateModel(names, fitted, 0.5, None, 0.0) for names in [("wind", "wave"), ("wind",)])
    judgment: Any = SimpleNamespace(beyond_range=None, verdict="ambiguous", answers=answers)
    model = SimpleNamespace(setup=Campaign(1).setup(WAVE, WIND))
    strategy: Any = SimpleNamespace(model=model, relinearized=lambda fit: fit)
    a = Estimate(2.0, 0.05, (1.9, 2.1), "", "", "line", 2.0)
    base = replace(named("base"), parameters=Parameters({"a": a}))
    assert _without_baseline(strategy, judgment, base) == excluded


class Including:
    """A problem that records the results that it includes."""

    def __init__(self) -> None:
        self.answers: list[str] = []

    def including(self, result: Result, answers: Sequence[tuple[float | None, Result]]) -> Result:
        self.answers = [a.sentence for _, a in answers]
        return result


@pytest.mark.parametrize("open_baseline", [True, False])
def test_the_baseline_is_included_only_where_it_is_an_answer(open_baseline: bool) -> None:
    problem: Any = Including()
    strategy: Any = None
    one = OpenAnswer("headwind", {}, result=named("slope and headwind"))
    answers = [one, *([OpenAnswer(BASELINE, {})] if open_baseline else [])]
    _Widening(strategy, problem, named("base"), named("slope")).including(answers)
    assert problem.answers == [*(["base"] if open_baseline else []), "slope and headwind"]


def test_an_answer_with_implausible_parameters_is_left_out() -> None:
    """A brake that stands for the rolling resistance, beside an answer that the step does not doubt."""
    doubt = Finding("rolling_resistance", "lower than that of any tire", "0.0008", doubt=True)
    brake = OpenAnswer("brake_drag_fading", {}, result=replace(named("brake"), findings=(doubt,)))
    rolling, unpublished = OpenAnswer("rolling", {}, result=named("rolling")), OpenAnswer("wind", {})
    kept, (note,) = least_doubtful([brake, rolling, unpublished])
    assert kept == [rolling, unpublished]
    assert note.minor
    assert "'brake_drag_fading'" in note.what
    assert "lower than that of any tire" in note.what
    assert least_doubtful([brake, unpublished]) == ([brake, unpublished], [])


def test_derived_parameters_follow_an_answer_that_the_step_cannot_publish() -> None:
    """Their intervals keep what else is uncertain: here as much as by the fitted parameter, as by an area."""
    a = Estimate(2.0, 0.05, (1.9, 2.1), "", "", "line", 2.0)
    base = replace(named("base"), parameters=Parameters({"a": a, "half": replace(a, value=1.0, interval95=(0.9, 1.1))}))
    fit: Any = SimpleNamespace(values={"a": 1.8}, std={"a": 0.1}, interval95={"a": (1.6, 2.0)}, correlation={})
    found = by_fit(fit, base, lambda values: {"half": 0.5 * values["a"]})
    assert found["a"].interval95 == (1.6, 2.0)
    assert found["half"].value == pytest.approx(0.9)
    assert found["half"].interval95 == pytest.approx((0.7, 1.1))


def test_two_forms_of_a_law_and_another_effect_share_their_probability() -> None:
    """Odds to no effect of 4 for either form, each of which is tried without the other one, and of 1 for a wind."""
    found = [OpenAnswer("brake", {}, probability=4 / 6), OpenAnswer("wind", {}, probability=1 / 6)]
    mixed = with_other_forms(found, [OpenAnswer("brake", {}, probability=4 / 6)])
    assert [one.probability for one in mixed] == pytest.approx([0.4, 0.1, 0.4])
