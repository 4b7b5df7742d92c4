"""Recommends the next tests, with the expected separation of ambiguous answers and of undetectable effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations, pairwise
from math import ceil

from vdyn_cli.diagnosis.judgment import NONE_VISIBLE, Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.next_tests.experiment_design import (
    Contrast,
    ExperimentDesigner,
    PlannedTest,
    fitted_beside,
    typical_contrast,
)
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FullModel
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.quantities.diagnosis import NextTest

# These choose what is shown, no verdict.
MOST_RUNS = 200  # of the same kind; if more are needed, another manoeuvre is recommended
SHOWN = 4  # manoeuvres in the report
HELPFUL = 1.0  # standard errors: a smaller separation is within chance
AT_TYPICAL = ", at half of the plausible range"


def next_tests(strategy: Strategy, judgment: Judgment) -> tuple[NextTest, ...]:
    """The next tests: first those with an expected separation, then the confirming tests that effects describe."""
    designer = ExperimentDesigner(strategy)
    setup = strategy.model.setup
    if judgment.verdict == "ambiguous":
        effects = {name for answer in judgment.answers for name in answer.effects}
        turning = setup.one_way and any(setup.candidates[name].turns_with_heading for name in effects)
        both_ways = _more_data(designer, judgment) if turning else ()
        return (*both_ways, *_discriminating(designer, list(combinations(judgment.answers, 2))))
    if judgment.verdict == "not_testable" or (judgment.verdict == "unknown" and setup.one_way):
        return _more_data(designer, judgment)
    if judgment.verdict == "unknown":
        closest = sorted(judgment.tried, key=lambda t: -t.residual_p)[:SHOWN]
        return _discriminating(designer, list(pairwise(closest)), more=False)
    return _revealing(designer, judgment)


def _discriminating(
    designer: ExperimentDesigner, pairs: Sequence[tuple[CandidateModel, CandidateModel]], more: bool = True
) -> tuple[NextTest, ...]:
    """For each pair of models that differ in one effect, the tests that discriminate between them.

    ``more``: whether more runs of the same kind are considered.
    """
    found: list[NextTest] = []
    plans: dict[tuple[str, ...], PlannedTest | None] = {}
    for one, other in pairs:
        mine, yours = set(one.effects) - set(other.effects), set(other.effects) - set(one.effects)
        if len(mine) != 1 or len(yours) != 1 or len(plans) == SHOWN:
            continue
        a, b = *mine, *yours
        contrasts = _contrasts(designer.strategy.model, (one, a), (other, b))
        plans[a, b] = designer.best(contrasts)
        found += _planned(designer, contrasts, (a, b), plans[a, b])
        found += _repeated(designer, contrasts, (a, b), plans[a, b]) if more else []
    effects = list(dict.fromkeys(e for pair in plans for e in pair))[:SHOWN]
    return (*found, *(_confirming(designer.strategy.model, e, plans) for e in effects))


def _contrasts(model: FullModel, *answers: tuple[CandidateModel, str]) -> tuple[Contrast, ...]:
    """For each of two answers, its effect at its amplitude while the other answer's effects are fitted.

    A rival with many unknowns is skipped: it imitates any simpler effect, which is then the answer.
    """
    found = []
    for (one, effect), (other, rival) in (answers, answers[::-1]):
        if len(model.amplitudes(rival)) <= max(POLICY.simple_unknowns, len(model.amplitudes(effect))):
            amplitudes = {n: one.fitted.values[n] for n in model.amplitudes(effect)}
            found.append(Contrast(amplitudes, fitted_beside(model, other.effects)))
    return tuple(found)


def _planned(
    designer: ExperimentDesigner,
    contrasts: Sequence[Contrast],
    separates: Sequence[str],
    best: PlannedTest | None,
    of: str = "",
) -> list[NextTest]:
    """The planned manoeuvre, if it helps. ``of``: text on the assumed amplitude, if none was estimated."""
    if best is None or best.t < HELPFUL:
        return []
    text = f"{best.text} (t is {designer.driven_separation(contrasts):.1f} now{of})"
    return [_next_test(text, separates, round(best.t, 1), best.runs)]


def _repeated(
    designer: ExperimentDesigner,
    contrasts: Sequence[Contrast],
    separates: Sequence[str],
    best: PlannedTest | None,
) -> list[NextTest]:
    """More runs of the same kind, if fewer than those of the planned manoeuvre suffice."""
    now, model = designer.driven_separation(contrasts), designer.strategy.model
    further = ceil(model.run_count * ((POLICY.separated_t / now) ** 2 - 1)) if now > 0 else MOST_RUNS + 1
    if not 0 < further <= MOST_RUNS or (best is not None and best.t >= POLICY.separated_t and further >= best.runs):
        return []
    t = designer.driven_separation(contrasts, 1 + further / model.run_count)
    return [_next_test(f"{further} more {model.setup.run}s of the same kind", separates, round(t, 1), further)]


def _revealing(designer: ExperimentDesigner, judgment: Judgment) -> tuple[NextTest, ...]:
    """Tests that reveal the undetectable effects at a typical amplitude, those with the fewest runs first."""
    model = designer.strategy.model
    answer = judgment.answer.effects if judgment.answer else ()
    hidden = [u.effect for u in judgment.untestable if u.effect not in answer]
    contrasts = {effect: (typical_contrast(model, effect, answer),) for effect in hidden}
    plans = {effect: designer.best(contrast) for effect, contrast in contrasts.items()}

    def order(effect: str) -> tuple[bool, float]:
        plan = plans[effect]
        if plan is None:
            return True, 0.0
        return plan.t < POLICY.separated_t, plan.runs if plan.t >= POLICY.separated_t else -plan.t

    effects = sorted(contrasts, key=order)[:SHOWN]
    found = [t for e in effects for t in _planned(designer, contrasts[e], (e,), plans[e], AT_TYPICAL)]
    return (*found, *(_confirming(model, e, {(e,): plans[e]}) for e in effects))


def _confirming(model: FullModel, effect: str, plans: Mapping[tuple[str, ...], PlannedTest | None]) -> NextTest:
    """The confirming test that the effect describes, with a remark if no planned manoeuvre helps."""
    own = {names: plan for names, plan in plans.items() if effect in names}
    rivals = dict.fromkeys(n for names in own for n in names if n != effect)
    candidate = model.setup.candidates[effect]
    text = candidate.confirm or f"a test in which only {candidate.label} changes"
    best = max((plan for plan in own.values() if plan is not None), key=lambda p: p.t, default=None)
    if best is not None and best.t < HELPFUL:
        verb = "discriminate between them" if rivals else "detect it"
        text += f" No {model.setup.run} can {verb} ({best.t:.1f} standard errors after {best.text})."
    return _next_test(text, (effect, *rivals))


def _more_data(designer: ExperimentDesigner, judgment: Judgment) -> tuple[NextTest, ...]:
    """More runs where these are too few; where all have one direction, runs in both and what these reveal."""
    model = designer.strategy.model
    setup, runs = model.setup, model.run_count
    if judgment.insufficient == NONE_VISIBLE:  # more runs of this kind reveal no candidate
        return _revealing(designer, judgment)
    wanted = max(POLICY.fewest_runs_between, setup.fewest_runs, runs if setup.one_way else 2 * runs)
    if not setup.one_way:
        text = f"{wanted} {setup.run}s instead of {runs}, each as long as the track allows"
        return (_next_test(text, runs=wanted),)
    turning = tuple(n for n, effect in setup.candidates.items() if effect.turns_with_heading)
    text = f"{wanted} {setup.run}s in pairs, out and back, over the same road"
    first = _next_test(text, turning, runs=wanted)
    if len(turning) < 2 or runs < setup.fewest_runs:
        return (first,)
    contrasts = [typical_contrast(model, effect, [e for e in turning if e != effect]) for effect in turning]
    return (first, *_planned(designer, contrasts, turning, designer.best(contrasts), AT_TYPICAL))


def _next_test(
    manoeuvre: str, separates: Sequence[str] = (), expected_t: float | None = None, runs: int | None = None
) -> NextTest:
    return NextTest(manoeuvre=manoeuvre, separates=tuple(separates), expected_t=expected_t, runs=runs)
