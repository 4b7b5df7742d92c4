"""One step from files to documents: read, estimate, diagnose, describe. Writes nothing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep, refuse_unknown
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.project.result_document import step_command, step_document
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, alike
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, Step, load_step, published


@dataclass(frozen=True)
class Outcome:
    """A step's result and its JSON document."""

    result: Result
    document: Mapping[str, Any]


def execute(
    step_name: str, path: Path, known_files: Sequence[Path] = (), level: float | None = POLICY.level
) -> Outcome:
    """Run one step on one description, and diagnose what its simulation gets wrong.

    Parameters
    ----------
    level : chance that the diagnosis raises a false alarm; None leaves the diagnosis out.

    Raises
    ------
    InputError : the input is wrong.
    ResultError : the answer is not good.
    """
    step = load_step(step_name)
    inputs = gather(step, path, known_files)
    try:
        result = _estimated(step, inputs, level)
        if isinstance(result, Failure):
            raise result.error()
    except (InputError, ResultError) as error:
        raise type(error)(*(_placed(f, inputs) for f in error.findings), *_faults(inputs)) from None
    result = _warned(replace(result, findings=(*inputs.findings, *result.findings)))
    return Outcome(
        result, step_document(result, inputs, step_command(step_name, path, known_files, level), known_files)
    )


def _estimated(step: Step, inputs: Inputs, level: float | None) -> Result | Failure:
    """The diagnosed result; or the failure of the baseline, which is not diagnosed."""
    prepared = PreparedStep(step, inputs.spec, inputs.known, step.prepare(inputs.spec, inputs.data, inputs.known))
    if level is None:
        return published(prepared.problem)
    refuse_unknown(prepared)
    result = published(prepared.problem)
    if isinstance(result, Failure):
        return result
    doubts = tuple(f for f in inputs.findings if f.doubt)
    return diagnosed(prepared, result, level, _faults(inputs, result.fit.runs), doubts)


def _faults(inputs: Inputs, used: Sequence[str] = ()) -> tuple[Finding, ...]:
    """Sensors that did not measure, in the used runs; in all runs where none are given."""
    logs = [log for log in inputs.logs if log.name in used] or inputs.logs
    return tuple(f for log in logs for f in log.findings if f.fault)


def _placed(finding: Finding, inputs: Inputs) -> Finding:
    """The finding with file and line, where it names a key of the description: ``settings.step``."""
    location = tuple(finding.where.split("."))
    # A step, or a log, may be called as a key is.
    another = finding.where == inputs.spec.test or finding.where.startswith(tuple(log.name for log in inputs.logs))
    if another or location[0] not in type(inputs.spec).model_fields:
        return finding
    return replace(finding, where=inputs.source.where(location), what=f"'{finding.where}': {finding.what}")


def _warned(result: Result) -> Result:
    """The result, with a warning for each doubt, and for data missed by far more than noise explains."""
    fit = result.fit
    doubts = [f"{f.where}: {f.what}" for f in alike(result.findings) if f.doubt]
    warnings = [*doubts, *fit.warnings]
    if fit.misfit:
        warnings.append(f"{fit.misfit}. Unmodeled effect present; values may be off by more than their intervals state")
    return replace(result, fit=replace(fit, warnings=tuple(warnings)))
