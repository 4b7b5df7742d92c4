"""From a step's baseline result to its diagnosed and, where a cause was named, extended result."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from math import inf
from typing import Any

import numpy as np

from vdyn_cli.diagnosis.case import Case, begun_at, shapes_of, unknowns_of
from vdyn_cli.diagnosis.document import document, not_diagnosed
from vdyn_cli.diagnosis.level import LEVEL
from vdyn_cli.diagnosis.next_test import next_tests
from vdyn_cli.diagnosis.sizes import estimate_of, sizes_of
from vdyn_cli.diagnosis.verdict import Verdict, judge
from vdyn_cli.diagnosis.where import where
from vdyn_cli.diagnosis.words import chance, sentence, size_of
from vdyn_cli.diagnosis.workbench import open_workbench
from vdyn_cli.effects import Effect, candidates
from vdyn_cli.engine.offer import offered
from vdyn_cli.errors import Finding, ResultError, raise_all
from vdyn_cli.parameters import Estimate, Parameters
from vdyn_cli.result import Comparison, Result
from vdyn_cli.spec import Diagnose, TestSpec
from vdyn_cli.steps import Diagnosable, Step


def diagnosed(
    step: Step,
    spec: TestSpec,
    data: Any,
    known: Parameters,
    result: Result,
    level: float = LEVEL,
    faults: Sequence[Finding] = (),
    doubts: Sequence[Finding] = (),
) -> Result:
    """The result with its diagnosis, of the extended model where a cause was named or asked for.

    Parameters
    ----------
    result : of the baseline.
    level : chance of a false alarm of this step.
    faults : sensors that did not measure; while there are any, nothing else is blamed.
    doubts : reasons to doubt the result that were there before its estimate.

    Raises
    ------
    InputError : the description names an effect that is not known, or that this model does not have.
    """
    lent = step.diagnosable
    if lent is None or spec.diagnose.effects == "none" or not result.comparisons:
        return result  # nothing was simulated, as of a drawing alone
    case = case_of(step, spec, data, known, level)
    try:
        bench = open_workbench(case)
        verdict = judge(bench, faults)
    except (ResultError, ArithmeticError) as error:
        first = error.findings[0] if isinstance(error, ResultError) else Finding("fit", str(error))
        return _undiagnosed(result, first, faults)
    wanted = _wanted(spec, case, verdict)
    begun = bench.near(verdict.answer.fitted).values if verdict.answer else {}
    extended, failed = _extended(step, spec, data, known, [case.causes[c] for c in wanted], begun)
    if isinstance(spec.diagnose.extend, list):  # who asked for a cause has to know that the model is without it
        failed = tuple(replace(f, doubt=True) for f in failed)
    if nothing := _of_no_size(verdict, case, wanted, extended):
        verdict = verdict.refuted(f"{nothing} may as well be of no size")
        if spec.diagnose.extend == "named":
            wanted, extended = (), None
    accepted = wanted if extended is not None else ()
    taken = _sizes(extended, [case.causes[c] for c in accepted]) if extended else {}
    # Beside other causes than the verdict's, what was taken in has another size than the verdict has for it.
    as_named = any(set(answer.causes) == set(accepted) for answer in verdict.answers)
    sizes = _fitted(verdict, case) | (taken if as_named else {})
    biased = {} if extended is None else _biased(step, spec, data, known, result, extended, accepted, case)
    text = sentence(verdict, case.causes, sizes, isinstance(spec.diagnose.effects, list))
    last = extended or result
    told = next((f"{f.where} {f.what}" for f in (*doubts, *last.findings) if f.doubt), "")
    doubt = told or last.fit.misfit
    if not doubt and extended is not None:
        doubt = next(iter(last.fit.warnings), "")
    if verdict.name == "adequate" and told:
        text += f" But {told}."
    elif verdict.name == "adequate" and doubt:
        text = f"No cause shows for certain ({chance(verdict.detection.p_value)}), but {doubt}."
    wrong = where(result) if verdict.detection.p_value <= level else []
    sizes |= taken
    diagnosis = document(bench, verdict, text, accepted, sizes, biased, wrong, next_tests(bench, verdict), lent.metric)
    diagnosis |= {"doubt": doubt, "not_extended": failed[0].what if failed else ""}
    present = tuple(_present(spec, known, case))
    if extended is None:
        return replace(result, diagnosis=diagnosis, findings=(*result.findings, *failed, *present))
    extended = replace(extended, findings=(*extended.findings, *present))
    return _merged(result, extended, diagnosis, [case.causes[c] for c in accepted], taken)


def case_of(step: Step, spec: TestSpec, data: Any, known: Parameters, level: float = LEVEL) -> Case:
    """A diagnosable step's data and model, open to the causes that its description allows.

    Raises
    ------
    InputError : the description names an effect that is not known, or that this model does not have.
    """
    lent = step.diagnosable
    assert lent is not None
    every = offered(lent.model(spec, data, known), candidates(step.name))
    carried = tuple(e for e in every if lent.carries and e.name in known.extensions)
    effects = tuple(e for e in every if e not in carried)
    _refuse_unknown(spec.diagnose, effects, [e.name for e in carried])
    if isinstance(spec.diagnose.effects, list):
        effects = tuple(e for e in effects if e.name in spec.diagnose.effects)
    likely = lent.likely
    return Case(
        step=step.name,
        regression=lambda effects, extra, **begun: lent.regression(spec, data, known, effects, extra, **begun),
        effects=effects,
        profiles=lent.profiles(spec, data, known),
        one_way=_one_way(spec) if lent.two_way(spec) else "",
        repeated=lent.run,
        fewest_runs=lent.fewest_runs,
        too_short=_too_short(lent, data),
        level=level,
        straight=lent.straight(spec),
        bent=any(e.probes for e in carried),
        likely=None if likely is None else (lambda effect, begun: likely(spec, data, known, effect, begun)),
        manoeuvres=lambda full, values: lent.manoeuvres(spec, data, known, full, values),
    )


def _too_short(lent: Diagnosable, data: Any) -> str:
    """Why no run of the logs is long enough; empty where one is."""
    lasted = max((float(np.ptp(log.time)) for log in data), default=0.0) if lent.shortest else inf
    return f"no {lent.run} lasts longer than {lasted:.2g} s" if lasted < lent.shortest else ""


def _one_way(spec: TestSpec) -> str:
    """Why the runs are not there and back; empty where they are."""
    ways = {r.direction for r in spec.runs}
    if {"out", "back"} <= ways:
        return ""
    if None in ways:
        return "no run says which way it went" if ways == {None} else "some runs do not say which way they went"
    return "all runs went the same way"


def _refuse_unknown(asked: Diagnose, effects: Sequence[Effect], carried: Sequence[str]) -> None:
    """Refuse to look for, or to take in, what the model cannot take.

    What an earlier step found is in the model: whether it did must not decide whether a description is right.
    """
    names = [e.name for e in effects]
    why, remedy = "is no effect that this model can take", f"there are: {', '.join(names)}"
    raise_all(
        Finding(f"diagnose.{key}", why, name, remedy)
        for key, name in _listed(asked)
        if name not in names and name not in carried
    )


def _listed(asked: Diagnose) -> Iterator[tuple[str, str]]:
    """Each effect that is named, with the key under which it is."""
    for key in ("effects", "extend"):
        named = getattr(asked, key)
        yield from ((key, name) for name in (named if isinstance(named, list) else ()))


def _present(spec: TestSpec, known: Parameters, case: Case) -> Iterator[Finding]:
    """What was asked for and is in the model already."""
    for key, name in _listed(spec.diagnose):
        if name in known.extensions and name not in case.causes:
            yield Finding(f"diagnose.{key}", f"{name} is in the model already, from an earlier step", minor=True)


def _wanted(spec: TestSpec, case: Case, verdict: Verdict) -> tuple[str, ...]:
    """The causes to extend the model with: those asked for, or the one that was named."""
    extend = spec.diagnose.extend
    if isinstance(extend, list):
        return tuple(n for n in case.causes if n in extend)
    if extend == "named" and verdict.answer is not None:
        return verdict.answer.causes
    return ()


def _extended(
    step: Step, spec: TestSpec, data: Any, known: Parameters, causes: Sequence[Effect], begun: Mapping[str, float]
) -> tuple[Result | None, tuple[Finding, ...]]:
    """The step's estimate with causes in its model, or why there is none; what shapes them is free where data allow it.

    ``begun``: where to begin, for steps to which that matters.
    """
    if not causes:
        return None, ()
    failed: tuple[Finding, ...] = ()
    extra = [begun_at(u, begun) for e in causes for u in unknowns_of(e)]
    shapes = {n for e in causes for n in shapes_of(e)}
    for free in (extra, [u for u in extra if u.name not in shapes]) if shapes else (extra,):
        try:
            return step.estimate(spec, data, known, effects=tuple(causes), extra=tuple(free)), ()
        except ResultError as error:
            failed = _not_extended(causes, error.findings[0])
    return None, failed


def _of_no_size(verdict: Verdict, case: Case, causes: Sequence[str], extended: Result | None) -> str:
    """What the verdict names and what may as well be of no size, in words; nothing where it stands.

    The sizes are those of the model that is extended by what the verdict names and nothing else, else the diagnosis's.
    """
    if not verdict.answers:
        return ""
    if verdict.answer is None:
        each = (len(a.causes) == 1 and _may_be_nothing(sizes_of(a, case), case, a.causes) for a in verdict.answers)
        return "it, like what it cannot be told from," if all(each) else ""
    named = verdict.answer.causes
    if extended is not None and set(causes) == set(named):
        return _may_be_nothing(_sizes(extended, [case.causes[c] for c in named]), case, named)
    return _may_be_nothing(sizes_of(verdict.answer, case), case, named)


def _may_be_nothing(sizes: Mapping[str, Estimate], case: Case, causes: Sequence[str]) -> str:
    """The cause of one unknown whose interval holds zero; nothing where there is none."""
    for effect in (case.causes[c] for c in causes):
        (first, *others) = effect.unknowns
        if not others and first in sizes and _holds_zero(sizes[first]):
            return effect.label if len(causes) > 1 else "it"
    return ""


def _holds_zero(size: Estimate) -> bool:
    return size.interval95[0] <= 0.0 <= size.interval95[1]


def _not_extended(causes: Sequence[Effect], why: Finding) -> tuple[Finding, ...]:
    where = "" if why.where == "fit" else f"{why.where}: "
    what = f"the model could not be extended by {', '.join(e.name for e in causes)}: {where}{why.what}"
    return (Finding("diagnosis", what, why.got, why.remedy),)


def _sizes(extended: Result, causes: Sequence[Effect]) -> dict[str, Estimate]:
    """As the extended model's fit gives them."""
    entries: Mapping[str, Any] = extended.extra.get("effects", {})
    return {
        n: estimate_of(effect, n, entries[n]["value"], entries[n]["std"], entries[n]["interval95"])
        for effect in causes
        for n in effect.unknowns
        if n in entries
    }


def _fitted(verdict: Verdict, case: Case) -> dict[str, Estimate]:
    """As the diagnosis fitted them, of causes that are not taken into the model.

    Of several answers only where each is a single cause: beside others, a cause has another size in every answer.
    """
    if len(verdict.answers) > 1 and any(len(answer.causes) > 1 for answer in verdict.answers):
        return {}
    return {n: e for answer in verdict.answers for n, e in sizes_of(answer, case).items()}


def _biased(
    step: Step,
    spec: TestSpec,
    data: Any,
    known: Parameters,
    base: Result,
    extended: Result,
    accepted: Sequence[str],
    case: Case,
) -> dict[str, dict[str, float]]:
    """By how much the parameters would be off for want of each cause, the others in the model."""
    found = {}
    for cause in accepted:
        others = [case.causes[c] for c in accepted if c != cause]
        without = _extended(step, spec, data, known, others, {})[0] if others and extended.parameters else base
        found[cause] = {} if without is None else _moved(without, extended)
    return found


def _moved(before: Result, after: Result) -> dict[str, float]:
    return {
        n: before.parameters[n].value - e.value
        for n, e in after.parameters.items()
        if n in before.parameters and before.parameters[n].value != e.value
    }


def _merged(
    base: Result,
    extended: Result,
    diagnosis: Mapping[str, Any],
    causes: Sequence[Effect],
    sizes: Mapping[str, Estimate],
) -> Result:
    """The extended result with the baseline's values and simulations beside its own, and the causes that last."""
    lasting = {e.name: {n: sizes[n] for n in e.unknowns if n in sizes} for e in causes if e.lasts}
    estimates = {
        n: replace(e, baseline=base.parameters[n].value) if n in base.parameters else e
        for n, e in extended.parameters.items()
    }
    before = {(c.run, c.channel): c for c in base.comparisons}
    comparisons = tuple(_beside(c, before.get((c.run, c.channel))) for c in extended.comparisons)
    return replace(
        extended,
        sentence=f"Extended by {' and '.join(f'{e.label}{size_of(e, sizes)}' for e in causes)}: {extended.sentence}",
        parameters=Parameters(estimates, extended.parameters.correlation, lasting),
        comparisons=comparisons,
        diagnosis=diagnosis,
    )


def _beside(one: Comparison, before: Comparison | None) -> Comparison:
    if before is None or before.simulated.shape != one.simulated.shape:
        return one
    return replace(one, baseline=before.simulated)


def _undiagnosed(result: Result, why: Finding, faults: Sequence[Finding]) -> Result:
    fault = f"{faults[0].where} {faults[0].what}" if faults else ""
    told = why.what if why.where == "fit" else f"{why.where}: {why.what}"
    finding = Finding("diagnosis", "was not made", told, why.remedy, doubt=True)
    return replace(result, diagnosis=not_diagnosed(told, fault), findings=(*result.findings, finding))
