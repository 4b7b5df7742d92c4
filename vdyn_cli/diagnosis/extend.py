"""From a step's baseline result to its diagnosed and, where a cause was named, extended result."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

from vdyn_cli.description.test_description import TestSpec
from vdyn_cli.diagnosis.asked import case_of, present
from vdyn_cli.diagnosis.case import Case
from vdyn_cli.diagnosis.document import document, not_diagnosed
from vdyn_cli.diagnosis.extension import extension
from vdyn_cli.diagnosis.level import LEVEL
from vdyn_cli.diagnosis.next_test import next_tests
from vdyn_cli.diagnosis.sizes import sizes_of
from vdyn_cli.diagnosis.verdict import Verdict, judge
from vdyn_cli.diagnosis.where import where
from vdyn_cli.diagnosis.words import chance, sentence, size_of
from vdyn_cli.diagnosis.workbench import open_workbench
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Result
from vdyn_cli.steps import Problem, Step


def diagnosed(
    step: Step,
    spec: TestSpec,
    problem: Problem,
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
    case = case_of(step, spec, known, problem, level)
    try:
        bench = open_workbench(case)
        verdict = judge(bench, faults)
    except (ResultError, ArithmeticError) as error:
        first = error.findings[0] if isinstance(error, ResultError) else Finding("fit", str(error))
        return _undiagnosed(result, first, faults)
    verdict, taken = extension(bench, verdict, spec.diagnose.extend, problem, result)
    # Beside other causes than the verdict's, what was taken in has another size than the verdict has for it.
    as_named = any(set(answer.causes) == set(taken.causes) for answer in verdict.answers)
    sizes = _fitted(verdict, case) | (dict(taken.sizes) if as_named else {})
    text = sentence(verdict, case.causes, sizes, isinstance(spec.diagnose.effects, list))
    last = taken.result or result
    told = next((f"{f.where} {f.what}" for f in (*doubts, *last.findings) if f.doubt), "")
    doubt = told or last.fit.misfit
    if not doubt and taken.result is not None:
        doubt = next(iter(last.fit.warnings), "")
    if verdict.name == "adequate" and told:
        text += f" But {told}."
    elif verdict.name == "adequate" and doubt:
        text = f"No cause shows for certain ({chance(verdict.detection.p_value)}), but {doubt}."
    wrong = where(result) if verdict.detection.p_value <= level else []
    tests = next_tests(bench, verdict)
    diagnosis = document(
        bench, verdict, text, taken.causes, {**sizes, **taken.sizes}, taken.biased, wrong, tests, lent.metric
    )
    diagnosis |= {"doubt": doubt, "not_extended": taken.failed[0].what if taken.failed else ""}
    already = tuple(present(spec, known, case))
    if taken.result is None:
        return replace(result, diagnosis=diagnosis, findings=(*result.findings, *taken.failed, *already))
    extended = replace(taken.result, findings=(*taken.result.findings, *already))
    return _merged(result, extended, diagnosis, [case.causes[c] for c in taken.causes], taken.sizes)


def _fitted(verdict: Verdict, case: Case) -> dict[str, Estimate]:
    """As the diagnosis fitted them, of causes that are not taken into the model.

    Of several answers only where each is a single cause: beside others, a cause has another size in every answer.
    """
    if len(verdict.answers) > 1 and any(len(answer.causes) > 1 for answer in verdict.answers):
        return {}
    return {n: e for answer in verdict.answers for n, e in sizes_of(answer, case).items()}


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
    finding = Finding("diagnosis", f"was not made: {told}", why.got, why.remedy, doubt=True)
    return replace(result, diagnosis=not_diagnosed(told, fault), findings=(*result.findings, finding))
