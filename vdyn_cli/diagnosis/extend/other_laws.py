"""Widens the intervals to include the answers in which a named effect acts by another form of its law.

The form of some laws is an assumption: a brake may release exponentially or more slowly. The data often cannot
discriminate between the forms, while the parameters and forces beside them differ by several half intervals.
"""

from __future__ import annotations

from collections.abc import Collection, Iterator
from dataclasses import replace

from vdyn_cli.diagnosis.extend.interval_union import OpenAnswer, widened
from vdyn_cli.diagnosis.extend.published_answers import publish_with
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.effects import in_other_form
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.wider_intervals import with_wider_intervals

HOLD_FORMS = "The intervals include the effect with another form of its law, such as a slower decay."


def holding_other_laws(strategy: Strategy, judgment: Judgment, result: Result, problem: SimulatedProblem) -> Result:
    """The result with intervals that include each answer with another form of a law of an effect in it.

    Of steps that publish numbers beyond parameters, such as forces over speed. A form by which the effect explains
    clearly less than by its own law is excluded. Amplitudes have a prior as wide as their ranges: where all coasts
    begin at one speed, a brake that fades slowly and the drag area are nearly collinear.
    """
    if not result.parameters or not problem.has_further_numbers:
        return result
    found = [one for answer in judgment.possible for one in _others(strategy, answer, problem)]
    if not found:
        return result
    result = problem.including(result, [(None, one.result) for one in found if one.result is not None])
    return with_wider_intervals(result, widened(result.parameters, found), HOLD_FORMS)


def in_other_forms(strategy: Strategy, names: Collection[str]) -> Strategy | None:
    """The strategy whose named effects act by the other form of their law; None where it cannot be fitted."""
    setup = strategy.model.setup
    effects = tuple((in_other_form(e) or e) if e.name in names else e for e in setup.effects)
    try:
        return open_strategy(replace(setup, effects=effects))
    except (ResultError, ArithmeticError):
        return None


def _others(strategy: Strategy, answer: CandidateModel, problem: SimulatedProblem) -> Iterator[OpenAnswer]:
    """The published results of an answer with the other form of each law that has one."""
    candidates = strategy.model.setup.candidates
    for name in answer.effects:
        other = in_other_form(candidates[name])
        if other is None or _explains_less(strategy, answer, name):
            continue
        result = publish_with(problem, [other if e == name else candidates[e] for e in answer.effects], prior=True)[0]
        if result is not None:
            yield OpenAnswer(" + ".join(answer.effects), result.parameters, result=result)


def _explains_less(strategy: Strategy, answer: CandidateModel, name: str) -> bool:
    """Whether an answer explains clearly less with the other form of an effect; so does one that cannot be fitted."""
    opened = in_other_forms(strategy, {name})
    try:
        fitted = opened.fitted(answer.effects) if opened else None
    except (ResultError, ArithmeticError):
        return True
    if opened is None or fitted is None:
        return True
    explained = strategy.base.solution.cost - answer.cost
    return opened.base.solution.cost - fitted.solution.cost < explained - POLICY.clearly_better
