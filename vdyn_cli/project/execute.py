"""Execution of one step from its files to its result: read, estimate, diagnose. Writes nothing."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path

from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, refuse_unknown
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.io.file_units import wrong_units
from vdyn_cli.io.quality.cuts import cut_findings
from vdyn_cli.project.checks.exact_values import exact_values, implausible_rotating_mass
from vdyn_cli.project.checks.missing_starts import missing_starts
from vdyn_cli.project.checks.redundancy import contradicted_radius
from vdyn_cli.project.checks.simulated_gains import simulated_gain_findings
from vdyn_cli.project.inputs import Inputs, LoggedTest, errors_of_step, logged_test, placed, with_known
from vdyn_cli.project.reading.cut_changes import with_changes
from vdyn_cli.project.reading.input_uncertainty import with_input_uncertainty
from vdyn_cli.project.result_document import StepRecord, provenance_of, step_command
from vdyn_cli.quantities.errors import Finding, ImplausibleValue, InputError, ResultError, merge_similar, raise_all
from vdyn_cli.quantities.number_text import capitalized
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, Step, load_step, published
from vdyn_cli.steps.interval_text import with_interval
from vdyn_cli.steps.wider_intervals import within_physical_range

_LOG = logging.getLogger(__name__)


class RefusedResultError(ResultError):
    """A result that is not published; its findings state why.

    Parameters
    ----------
    record : comparisons, diagnosis and reasons, without parameters, for the step's JSON and report.
    """

    def __init__(self, record: StepRecord) -> None:
        super().__init__(*record.result.refused)
        self.record = record


def execute(
    step_name: str,
    path: Path,
    known_files: Sequence[Path] = (),
    level: float | None = POLICY.level,
    test: LoggedTest | None = None,
) -> StepRecord:
    """Run one step on one description, and diagnose the errors of its model.

    Parameters
    ----------
    step_name, path : the step and the YAML file that describes its test.
    known_files : parameter JSON files of earlier steps, the later ones preferred.
    level : false-alarm probability of the diagnosis; None: no diagnosis.
    test : the description and its logs, if they are read already.

    Raises
    ------
    InputError : the description, a log or a parameter file is wrong.
    RefusedResultError : the input is well-formed, but the result cannot be published.
    """
    _LOG.info("reading the logs")
    inputs = _with_contradictions(with_known(test or logged_test(load_step(step_name), path), known_files))
    raise_all(merge_similar(wrong_units(f for log in inputs.logs for f in log.findings)))
    try:
        baseline, found = _estimated(inputs.step, inputs, level)
        result = within_physical_range(with_input_uncertainty(found, inputs))
    except InputError as error:
        found_by_step = (placed(f, inputs.spec, inputs.source, inputs.logs) for f in error.findings)
        raise type(error)(*found_by_step, *_data_faults(inputs)) from None
    refused = tuple(placed(f, inputs.spec, inputs.source, inputs.logs) for f in result.refused)
    if refused:
        refused = tuple(dict.fromkeys((*refused, *_data_faults(inputs))))
    quality = with_changes(inputs, baseline)
    given = (*exact_values(inputs), *implausible_rotating_mass(inputs), *(() if level else _dropped_extension(inputs)))
    if "start" in (inputs.step.run_keys or ()):
        given = (*given, *missing_starts(inputs.spec.runs, inputs.logs, result.diagnosis))
    findings = (*inputs.findings, *given, *result.findings)
    result = with_warnings(replace(result, refused=refused, findings=findings, quality=quality, restate=None))
    made = provenance_of(inputs, step_command(step_name, path, known_files, level), known_files)
    record = StepRecord(result, made)
    if result.refused:
        raise RefusedResultError(record)
    return record


def _with_contradictions(inputs: Inputs) -> Inputs:
    """The inputs with a doubt for each stated direction, start or wheel radius that the logs contradict."""
    conditions = (replace(f, doubt=True) for f in inputs.contradicted)
    computed = [(one.channel.source, one.channel.target) for one in inputs.scalings]
    radius = contradicted_radius([one.log for one in inputs.unsplit], inputs.known, computed, inputs.clocks)
    return replace(inputs, findings=(*radius, *inputs.findings, *conditions))


def _dropped_extension(inputs: Inputs) -> tuple[Finding, ...]:
    """A finding if the description requests effects that a run without a diagnosis does not add."""
    extend = inputs.spec.diagnose.extend
    if isinstance(extend, str):
        return ()
    what = f"'extend' is not applied without a diagnosis: {', '.join(extend)}"
    place = inputs.source.where(("diagnose", "extend"))
    return (Finding(place, what, remedy="leave out --no-diagnose", doubt=True),)


def _estimated(step: Step, inputs: Inputs, level: float | None) -> tuple[Result, Result]:
    """The baseline, and the diagnosed result; both state the reasons if they cannot be published."""
    _LOG.info("fitting")
    try:
        with errors_of_step(step, inputs.source, inputs.logs):
            problem = step.prepare(inputs.spec, inputs.data, inputs.known)
    except ResultError as error:
        failed = Failure.from_error(error).refused(step.name)
        return failed, failed
    prepared = PreparedStep(step, inputs.spec, inputs.known, problem)
    if level is not None:
        refuse_unknown(prepared)
    answer = _answered(prepared, inputs, level)
    if step.diagnosable is None or not answer[1].refused:
        return answer
    with suppress(InputError, ResultError):  # no data for a narrower question, or a simulation that is not finite
        if narrower := step.diagnosable.narrower(problem):
            other = _answered(replace(prepared, spec=narrower[0], problem=narrower[1]), inputs, level)
            return answer if other[1].refused else (other[0], _in_place_of(answer[1], other[1], step.diagnosable.run))
    return answer


def _in_place_of(refused: Result, narrower: Result, run: str) -> Result:
    """The result of the narrower question, with a warning that states why the wider one has none."""
    first, verdict = refused.refused[0], refused.diagnosis
    what = f"no result for the whole {run}: {first.what}" + (f". {verdict.sentence.rstrip('.')}" if verdict else "")
    warning = replace(first, what=what, doubt=True)
    return replace(narrower, findings=(warning, *narrower.findings))


def _answered(prepared: PreparedStep, inputs: Inputs, level: float | None) -> tuple[Result, Result]:
    """The baseline and the diagnosed result of a prepared step."""
    step, found = prepared.step, published(prepared.problem)
    result = found.refused(step.name) if isinstance(found, Failure) else found
    result = replace(result, findings=(*result.findings, *simulated_gain_findings(result.comparisons)))
    if level is None:
        return result, result
    doubts = tuple(f for f in (*inputs.findings, *implausible_rotating_mass(inputs)) if f.doubt)
    of_logs = {f for log in inputs.logs for f in log.findings}
    faults = (
        *_faults(inputs, result.fit.runs if result.fit else ()),
        *(f for f in result.findings if f.fault and f not in of_logs),
    )
    _LOG.info("testing the model for errors")
    return result, diagnosed(prepared, result, level, faults, doubts)


def _faults(inputs: Inputs, used: Sequence[str] = ()) -> tuple[Finding, ...]:
    """Findings on failed sensors in the runs used, or in all runs if those are unknown."""
    logs = [log for log in inputs.logs if log.name in used] or inputs.logs
    return tuple(f for log in logs for f in log.findings if f.fault)


def _data_faults(inputs: Inputs) -> tuple[Finding, ...]:
    """Findings on failed sensors and on cuts, which may be the reason for the missing result."""
    return (*_faults(inputs), *cut_findings(inputs.quality.ledger))


def with_warnings(result: Result) -> Result:
    """The result with a warning for each doubtful finding and a large residual, without parameters not determined.

    Its sentence begins with the values that no vehicle of the usual kinds has. They are published: rail vehicles, solar
    cars and bicycles have other values than cars.
    """
    fit = result.fit
    doubts = [str(f) for f in merge_similar(result.findings) if f.doubt]
    warnings = [*doubts, *fit.warnings]
    if fit.misfit:
        warnings.append(f"{fit.misfit}. Unmodeled effect present; values may be off by more than their intervals state")
    result = _with_implausible(replace(result, fit=replace(fit, warnings=tuple(warnings))))
    return _withholding(result, result.undetermined) if result.undetermined else result


def _with_implausible(result: Result) -> Result:
    found = [f for f in result.findings if isinstance(f, ImplausibleValue) and f.where in result.parameters]
    if not found:
        return result
    each = "; ".join(f"{f.where} is {f.what} ({f.got})" for f in found)
    return replace(result, sentence=f"Implausible: {each}. {result.sentence}")


def _withholding(result: Result, wide: Sequence[str]) -> Result:
    """The result without the parameters ``wide``, whose intervals are wider than their values, and with a warning."""
    verdict = result.diagnosis.verdict if result.diagnosis else ""
    left = ", and the diagnosis is not conclusive" if verdict in ("unknown", "not_testable", "ambiguous") else ""
    doubt = f"not determined: {', '.join(wide)} (95 % interval wider than the value){left}"
    withheld = {**result.withheld}
    for name in wide:
        one = result.parameters[name]
        withheld[name] = f"its 95 % interval is wider than its value: {with_interval(one, one.unit)}"
    left_over = result.parameters.without(wide)
    refused = result.refused
    if not result.determines:
        what = "no parameter is determined: each 95 % interval is wider than its value"
        refused = (*refused, Finding(result.step, what, "", "log more runs, or state more values as known"))
    return replace(
        result,
        sentence=f"{capitalized(doubt)}. {result.sentence}",
        fit=replace(result.fit, warnings=(doubt, *result.fit.warnings)),
        parameters=left_over,
        withheld=withheld,
        refused=refused,
    )
