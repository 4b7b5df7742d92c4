"""Diagnoses a step's baseline result and, where an effect is named, extends the result by it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial

from vdyn_cli.diagnosis import published_fields
from vdyn_cli.diagnosis.detect.detectability import detectable, lacking_channels
from vdyn_cli.diagnosis.detect.worst_segments import worst_segments
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup, PreparedStep, already_included, setup_of
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes, open_amplitudes
from vdyn_cli.diagnosis.extend.extension import Extension, extended, without_idle_answer
from vdyn_cli.diagnosis.extend.open_answers import holding_free_curve, with_open_answers
from vdyn_cli.diagnosis.extend.other_laws import holding_other_laws
from vdyn_cli.diagnosis.extend.published_answers import published_answer, without_zero_answers
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_judgment import judge
from vdyn_cli.diagnosis.name.nuisance_effects import with_nuisance_effects
from vdyn_cli.diagnosis.next_tests.next_test import next_tests
from vdyn_cli.diagnosis.part.part_judgment import PartJudgment, free_curve, with_part
from vdyn_cli.diagnosis.part.published_part import part_figure, with_published_part
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.size.finding_size import Limits
from vdyn_cli.diagnosis.size.materiality import limits_of
from vdyn_cli.diagnosis.size.published_size import effect_sizes, published_size, remainder
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.diagnosis.verdict_text import (
    amplitude_text,
    data_fault,
    not_possible,
    p_text,
    verdict_sentence,
    with_undetected_bias,
)
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Comparison, Result
from vdyn_cli.steps import Failure
from vdyn_cli.steps.wider_intervals import followed_by


def diagnosed(
    prepared: PreparedStep,
    result: Result,
    level: float = POLICY.level,
    faults: Sequence[Finding] = (),
    doubts: Sequence[Finding] = (),
) -> Result:
    """The result with its diagnosis; the result of the extended model where an effect was named or requested.

    Parameters
    ----------
    result : of the baseline; a refused one is diagnosed, too.
    level : false-alarm probability of this step, 0 to 1.
    faults : sensors that did not measure; with any, no effect is named.
    doubts : reasons to doubt the result that were known before the estimate.

    Raises
    ------
    InputError : the description names an effect that is unknown or not applicable to this model, or ``matters`` names
        a quantity that the result does not have.
    """
    requested = prepared.spec.diagnose
    if prepared.step.diagnosable is None or requested.effects == "none":
        return result
    if not (result.comparisons or result.refused):
        return result  # nothing was simulated: for example, an inertia from a drawing
    try:
        return _diagnosed(prepared, result, level, faults, doubts)
    except (ResultError, ArithmeticError) as error:  # of a fit: the baseline's result stands
        return _not_diagnosed(result, Failure.from_error(error).findings[0], faults)
    except InputError as error:
        if not result.refused:
            raise
        return _not_diagnosed(result, error.findings[0], faults)


def _diagnosed(
    prepared: PreparedStep, base: Result, level: float, faults: Sequence[Finding], doubts: Sequence[Finding]
) -> Result:
    requested, problem = prepared.spec.diagnose, prepared.simulated_problem
    setup = setup_of(prepared, level)
    strategy = open_strategy(setup)
    limits = limits_of(base, _metric(prepared)[1], requested.matters)
    by_part = with_part(strategy, judge(strategy, faults, limits), problem)
    prepared, by_part = _with_free_form(prepared, by_part, level, faults, limits)
    problem = prepared.simulated_problem
    strategy = by_part.strategy
    judgment = _with_misfit(with_nuisance_effects(strategy, by_part.judgment, limits), base)
    judgment, extension = extended(strategy, judgment, requested.extend, prepared.problem, base)
    extension = replace(extension, amplitudes=open_amplitudes(strategy, judgment, extension.amplitudes))
    result = with_open_answers(strategy, judgment, extension, problem, base)
    if requested.extend == "named" and (idle := without_idle_answer(judgment, extension, base, limits)):
        judgment, extension, result = idle, Extension(), base
    diagnosis = with_published_part(_described(prepared, strategy, judgment, extension, base), by_part)
    law = strategy.model.setup.candidates[by_part.law.effect] if by_part.law is not None else None
    result = holding_other_laws(strategy, judgment, result, problem)
    result = holding_free_curve(result, free_curve(by_part, judgment, extension.effects), law, problem)
    diagnosis = _doubted(with_undetected_bias(diagnosis, result.parameters), result, doubts)
    notes = (*extension.failed, *already_included(prepared, setup), *_note(diagnosis))
    result = replace(
        result,
        diagnosis=diagnosis,
        findings=(*result.findings, *_without_effects(base, extension), *notes),
        figures=(*result.figures, *((part_figure(diagnosis.part),) if diagnosis.part else ())),
    )
    return result if extension.result is None else _beside_baseline(base, result, extension, by_part)


def _with_free_form(
    prepared: PreparedStep, found: PartJudgment, level: float, faults: Sequence[Finding], limits: Limits
) -> tuple[PreparedStep, PartJudgment]:
    """The step and the judgment with a free form of the main law, if only that shows an answer of the catalog.

    The wrong form of a law hides every other error: no candidate is sufficient beside it, and a learned law absorbs
    what else is wrong. An answer that leaves more than noise leaves the error of the form in the parameters. An answer
    with which the model cannot be fitted is none. If the free form shows no error, every answer and every learned law
    stood for the wrong form. A learned law is kept where it predicts held-out runs better than the answer beside the
    free form, unless that is a single effect that leaves only noise.
    """
    free = getattr(prepared.problem, "with_free_form", None)  # a problem of a plug-in may have none
    if free is None or found.judgment.verdict in ("adequate", "not_testable"):
        return prepared, found
    complete, listed = any(a.sufficient for a in found.judgment.answers), found.learned is None
    idle = complete and listed and not without_zero_answers(found.strategy, found.judgment, prepared.problem)[0].answers
    if complete and listed and not idle:
        return prepared, found
    freed = replace(prepared, problem=free)
    try:
        strategy = open_strategy(setup_of(freed, level))
        judgment = judge(strategy, faults, limits)
    except (ResultError, ArithmeticError):
        return prepared, found
    by_law, by_form = found.judgment.gain, judgment.gain
    single = any(a.sufficient and len(a.effects) == 1 for a in judgment.answers)
    if not (listed or single) and by_law is not None and by_form is not None and by_law.after < by_form.after:
        return prepared, found
    shown = any(published_answer(strategy, a, free)[0] is not None for a in judgment.answers)
    taken = shown or judgment.verdict == "adequate"
    return (freed, PartJudgment(strategy, judgment)) if taken else (prepared, found)


def _with_misfit(judgment: Judgment, base: Result) -> Judgment:
    """The judgment with a residual far above the noise floor as evidence, where no test is significant.

    Each test compares blocks with each other. In a few blocks, an error as large as the signal is part of the noise
    that they show, and the noise floor of the sensors alone contradicts it.
    """
    if judgment.material is not None or not base.fit.misfit:
        return judgment
    return replace(judgment, material=True, refutation=base.fit.misfit)


def _described(
    prepared: PreparedStep, strategy: Strategy, judgment: Judgment, extension: Extension, base: Result
) -> Diagnosis:
    """The diagnosis, without its reasons for doubt."""
    model, setup, found = strategy.model, strategy.model.setup, judgment.detection
    # An effect of the extension has another amplitude than in the judgment if the other effects beside it differ.
    as_named = any(set(answer.effects) == set(extension.effects) for answer in judgment.answers)
    amplitudes = open_amplitudes(strategy, judgment, _fitted(judgment, setup))
    amplitudes |= extension.amplitudes if as_named else {}
    if judgment.nuisance is not None:
        amplitudes = {**fitted_amplitudes(judgment.nuisance.model, setup), **amplitudes}
    narrowed, last = isinstance(prepared.spec.diagnose.effects, list), extension.result
    metric = _metric(prepared)
    unit = metric[1]
    exact = last if judgment.answer and set(judgment.answer.effects) == set(extension.effects) else None
    judgment = _with_noise_floor(judgment, last or base, unit)
    size = published_size(judgment.size, base, exact, unit)
    sizes = effect_sizes(strategy, judgment, base, exact, unit)
    silent = judgment.verdict == "adequate" and judgment.material is not False
    shown = detectable(model, judgment.base, found) if silent else ()
    return Diagnosis(
        verdict=judgment.verdict,
        sentence=verdict_sentence(judgment, setup.candidates, amplitudes, narrowed, size, shown),
        p_value=found.p_value,
        evidence=published_fields.evidence(found),
        causes=published_fields.causes(model, judgment, extension, {**amplitudes, **extension.amplitudes}, sizes),
        extended=extension.effects,
        ambiguous=published_fields.ambiguous(judgment),
        not_testable=(*judgment.untestable, *lacking_channels(setup)),
        detectable=shown,
        gain=published_fields.gain(judgment, metric),
        size=size,
        remainder=remainder(judgment),
        material=judgment.material,
        where=worst_segments(base) if found.p_value <= setup.level else (),
        ranking=published_fields.ranking(model, judgment),
        next_test=next_tests(strategy, judgment),
        not_extended=extension.failed[0].what if extension.failed else "",
    )


def _metric(prepared: PreparedStep) -> tuple[str, str]:
    """Name and unit of the main channel."""
    assert prepared.step.diagnosable is not None
    return prepared.step.diagnosable.metric_of(prepared.problem) or prepared.step.diagnosable.metric


def _with_noise_floor(judgment: Judgment, last: Result, unit: str) -> Judgment:
    """The judgment whose gain in the main channel has the noise floor of the last model's fit."""
    gain, fit = judgment.gain, last.fit
    if gain is None or not gain.plain or fit.unit != unit or not fit.noise_floor > 0:
        return judgment
    return replace(judgment, gain=replace(gain, floor=fit.noise_floor))


def _note(diagnosis: Diagnosis) -> tuple[Finding, ...]:
    """A note on a significant model error that does not matter."""
    if diagnosis.material is not False:
        return ()
    remedy = "if smaller changes matter, state them under diagnose.matters"
    return (Finding("diagnosis", diagnosis.sentence, remedy=remedy, minor=True),)


def _doubted(diagnosis: Diagnosis, last: Result, doubts: Sequence[Finding]) -> Diagnosis:
    """The diagnosis with the first reason to doubt the result; the sentence of an adequate model states it."""
    stated = next((f"{f.where}: {f.what}" for f in (*doubts, *last.findings) if f.doubt), "")
    doubt = stated or last.fit.misfit or next(iter(last.fit.warnings), "")
    sentence = diagnosis.sentence
    if diagnosis.verdict == "adequate" and doubt:
        if diagnosis.material is False or diagnosis.p_value is None or stated:
            sentence += f" But {doubt}."
        else:
            sentence = f"No candidate effect is significant ({p_text(diagnosis.p_value)}), but {doubt}."
    return diagnosis.model_copy(update={"doubt": doubt, "sentence": sentence})


def _fitted(judgment: Judgment, setup: DiagnosisSetup) -> dict[str, Estimate]:
    """Amplitudes of the effects of all answers, or of the one effect beyond its range, as the diagnosis fitted them.

    Empty for several answers of which one has several effects: an effect then has another amplitude in each.
    """
    if len(judgment.answers) > 1 and any(len(answer.effects) > 1 for answer in judgment.answers):
        return {}
    return {n: e for answer in judgment.possible for n, e in fitted_amplitudes(answer, setup).items()}


def _beside_baseline(base: Result, extended_result: Result, extension: Extension, found: PartJudgment) -> Result:
    """The extended result with the baseline's values and simulations, and its lasting effects for later steps."""
    setup, learned = found.strategy.model.setup, found.learned
    effects, amplitudes = [setup.candidates[e] for e in extension.effects], extension.amplitudes
    last = () if extension.open else [e for e in effects if e.lasts]  # one of several answers is not passed on
    lasting = {e.name: {n: amplitudes[n] for n in e.unknowns if n in amplitudes} for e in last}
    laws = {learned.name: learned.definition} if learned is not None and learned.name in lasting else {}
    none = None if base.refused else base.parameters  # a refused baseline has no values to compare with
    estimates = {
        n: replace(e, baseline=None) if none is None else replace(e, baseline=none[n].value) if n in none else e
        for n, e in extended_result.parameters.items()
    }
    before = {(c.run, c.channel): c for c in base.comparisons}
    labels = " and ".join(f"{e.label}{amplitude_text(e, amplitudes)}" for e in effects) + extension.labels_end
    includes, restate = f"The model includes {labels}.", extended_result.restate
    return replace(
        extended_result,
        sentence=f"{extended_result.sentence} {includes}",
        restate=None if restate is None else partial(followed_by, includes, restate),
        parameters=Parameters(estimates, extended_result.parameters.correlation, lasting, laws),
        comparisons=tuple(_with_baseline(c, before) for c in extended_result.comparisons),
    )


def _without_effects(base: Result, extension: Extension) -> tuple[Finding, ...]:
    """A note on why the baseline has no result, where the extended model has one."""
    if extension.result is None or not base.refused:
        return ()
    first = base.refused[0]
    without = "one of these effects" if extension.labels_end else " and ".join(extension.effects)
    return (Finding("diagnosis", f"without {without} the fit is refused: {first.reason}", first.got),)


def _with_baseline(one: Comparison, baselines: Mapping[tuple[str, str], Comparison]) -> Comparison:
    before = baselines.get((one.run, one.channel))
    if before is None or before.simulated.shape != one.simulated.shape:
        return one
    return replace(one, baseline=before.simulated)


def _not_diagnosed(result: Result, why: Finding, faults: Sequence[Finding]) -> Result:
    """The result where the diagnosis cannot fit its baseline."""
    if faults:
        diagnosis = Diagnosis(verdict="data_fault", sentence=data_fault(f"{faults[0].where} {faults[0].what}"))
    else:
        diagnosis = Diagnosis(verdict="not_testable", sentence=not_possible(why.reason))
    finding = Finding("diagnosis", f"not possible: {why.reason}", why.got, why.remedy, doubt=True)
    return replace(result, diagnosis=diagnosis, findings=(*result.findings, finding))
