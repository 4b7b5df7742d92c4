"""Expected accuracy of planned runs, from the logs of a description or, without logs, from simulated days."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import isfinite, sqrt
from pathlib import Path

import numpy as np

from vdyn_cli.description.spec_loading import load_partial
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.diagnosis.next_tests.expected_information import ExpectedInformation, expected_information
from vdyn_cli.project.checks.check import step_of
from vdyn_cli.project.checks.exact_values import implausible_rotating_mass
from vdyn_cli.project.inputs import Inputs, errors_of_step, gather
from vdyn_cli.project.planned.planned_inputs import DayDescription, planned_test
from vdyn_cli.project.reading.input_uncertainty import with_input_uncertainty
from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, merge_similar
from vdyn_cli.quantities.number_text import two_digits
from vdyn_cli.quantities.parameters import Estimate, wider_than_value
from vdyn_cli.quantities.plan_schema import AddedRuns, Assumed, PlanDocument, PlannedParameter
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.result_schema import FindingEntry
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps import Failure, Step, published

# Simulated days: a standard error from eight units scatters by a quarter, the mean of ten by a tenth.
DAYS = 10


@dataclass(frozen=True)
class _Expected:
    """A published result, and for each parameter its value, standard error and half-width for the planned runs."""

    inputs: Inputs
    result: Result
    figures: Mapping[str, tuple[float, float, float]]
    information: ExpectedInformation | None
    failed: tuple[Finding, ...] = ()


def plan(path: Path, known_files: Sequence[Path] = (), runs: int | None = None) -> PlanDocument:
    """The expected accuracy of the runs of a description, as a document.

    Parameters
    ----------
    path : the description. known_files : parameter files.
    runs : number of runs; None: those of the description, or the step's usual number.

    Raises
    ------
    InputError : the description or a log is wrong, only some of its logs exist, or the step needs a log to plan from.
    """
    step = step_of(path)
    if _logs_exist(step, path):
        inputs = gather(step, path, known_files)
        count = runs or len(inputs.spec.runs)
        return _document(_from_logs(inputs, count), count, "logs", ())
    test = planned_test(step, path, known_files, runs)
    return _document(_from_days(test), len(test.spec.runs), "simulated", tuple(_assumed(test)))


def _logs_exist(step: Step, path: Path) -> bool:
    """Whether the description has logs.

    Raises
    ------
    InputError : some of them exist and others do not.
    """
    read = load_partial(path, step.spec)
    if read.spec is None or not read.spec.runs:
        return False
    names = [n for run in read.spec.runs for n in ([run.log] if run.log else run.logs or [])]
    missing = [n for n in names if not (path.parent / n).exists()]
    if missing and len(missing) < len(names):
        what = f"{len(missing)} of {len(names)} logs do not exist: {', '.join(missing)}"
        remedy = "remove their runs, and plan from the others with --runs"
        raise InputError(Finding(read.source.where(("runs",)), what, "", remedy))
    return not missing


def _from_logs(inputs: Inputs, runs: int) -> _Expected:
    """From logs: the scatter between runs decreases with their number, the errors of inputs do not.

    Fewer runs than logged are taken to have the same directions and conditions in balance, which is said.
    """
    found = _published(inputs)
    result = found.refused(inputs.step.name) if isinstance(found, Failure) else found
    information, failed = _expected_information(inputs, runs)
    logged = len(inputs.spec.runs)
    if runs < logged:
        what = f"{runs} of {logged} runs are planned as if they had the directions and conditions of all in balance"
        remedy = f"for {runs} runs as logged, remove the others from the description and plan again"
        failed = (*failed, Finding("plan", what, "", remedy, doubt=True))
    fewer = sqrt(max(len(inputs.spec.runs), 1) / runs)
    whole = with_input_uncertainty(result, inputs)
    figures = {}
    for name, e in whole.parameters.items():
        own = result.parameters[name].std
        std = sqrt((own * fewer) ** 2 + max(e.std**2 - own**2, 0.0))
        figures[name] = (e.value, std, e.half_width * (std / e.std if e.std > 0 else 1.0))
    return _Expected(inputs, result, figures, information, failed)


def _from_days(test: DayDescription) -> _Expected:
    """From simulated days: the root mean square of their standard errors."""
    days = [test.day(seed) for seed in range(DAYS)]
    results = [(day, _published(day)) for day in days]
    found = [with_input_uncertainty(one, day) for day, one in results if not isinstance(one, Failure)]
    if 2 * len(found) < DAYS:  # most days give no result
        failure = next(one for _, one in results if isinstance(one, Failure))
        return _Expected(days[0], failure.refused(test.step.name), {}, None)
    figures = {}
    for name in found[0].parameters:
        each = [one.parameters[name] for one in found if name in one.parameters]
        value = test.at.get(name, float(np.median([e.value for e in each])))
        figures[name] = (value, rms(*(e.std for e in each)), rms(*(e.half_width for e in each)))
    information, failed = _expected_information(days[0], len(test.spec.runs))
    return _Expected(days[0], found[0], figures, information, failed)


def _published(inputs: Inputs) -> Result | Failure:
    """The result of the inputs, without the uncertainty of the inputs."""
    try:
        with errors_of_step(inputs.step, inputs.source, inputs.logs):
            return published(inputs.step.prepare(inputs.spec, inputs.data, inputs.known))
    except ResultError as error:
        return Failure.from_error(error)


def _expected_information(inputs: Inputs, runs: int) -> tuple[ExpectedInformation | None, tuple[Finding, ...]]:
    """The effects that the runs could detect; None and the reason if the diagnosis could not be prepared."""
    step = inputs.step
    if step.diagnosable is None or not inputs.logs or inputs.spec.diagnose.effects == "none":
        return None, ()
    try:
        problem = step.prepare(inputs.spec, inputs.data, inputs.known)
        return expected_information(PreparedStep(step, inputs.spec, inputs.known, problem), runs), ()
    except (ResultError, ArithmeticError) as error:
        return None, Failure.from_error(error).findings


def _assumed(test: DayDescription) -> Iterator[Assumed]:
    assert test.step.planned is not None
    for one in test.step.planned.settings:
        quantity = one.quantity
        stated = quantity.name in test.stated or quantity.name in test.known
        yield Assumed(
            name=quantity.name,
            value=test.at[quantity.name],
            unit=quantity.unit,
            meaning=quantity.meaning,
            stated=stated,
        )


def _document(expected: _Expected, runs: int, basis: str, assumed: Sequence[Assumed]) -> PlanDocument:
    inputs, result, shown = expected.inputs, expected.result, expected.information
    parameters = list(_parameters(expected))
    findings = merge_similar(
        [*implausible_rotating_mass(inputs), *inputs.findings, *result.findings, *result.refused, *expected.failed]
    )
    return PlanDocument.model_validate(
        {
            "format": "vdyn/plan/1",
            "step": inputs.step.name,
            "title": inputs.spec.title,
            "basis": basis,
            "runs": runs,
            "channels": sorted({n for log in inputs.logs for n in log.channels}),
            "good": all(p.determined for p in parameters),
            "sentence": _sentence(expected, parameters, runs, basis),
            "parameters": parameters,
            "detectable": shown.detectable if shown else (),
            "not_testable": shown.not_testable if shown else (),
            "confused": shown.confused if shown else (),
            "added": [_with_published(one, expected) for one in shown.added] if shown else (),
            "assumed": assumed,
            "findings": [FindingEntry(**f.to_json()) for f in findings],
        }
    )


def _parameters(expected: _Expected) -> Iterator[PlannedParameter]:
    """The parameters with a result, then those that the runs do not determine."""
    result, step = expected.result, expected.inputs.step
    for name, (value, std, half) in expected.figures.items():
        if not std > 0:  # by definition, such as F1 of a road load with two terms
            continue
        one = Estimate.of(name, value, std, (value - half, value + half), step.name)
        wide = wider_than_value(name, one)
        why = "the 95 % interval is wider than the value" if wide else ""
        yield PlannedParameter(
            name=name, value=value, std=std, half95=half, unit=one.unit, determined=not wide, why=why
        )
    lost = dict(result.withheld)
    if result.refused:
        lost |= {n: result.refused[0].what for n in step.gives if n in PARAMETERS}
    for name, why in lost.items():
        unit = PARAMETERS[name].unit
        yield PlannedParameter(name=name, value=None, std=None, half95=None, unit=unit, determined=False, why=why)


def _with_published(one: AddedRuns, expected: _Expected) -> AddedRuns:
    """The added runs with the standard errors of the published parameters.

    Each decreases like that of its unknown; one computed from several unknowns like the one that decreases least.
    """
    assert expected.information is not None
    now = expected.information.spread
    shares = {n: s / now[n] for n, s in one.std.items() if now[n] > 0 and isfinite(now[n])}
    least = max(shares.values(), default=1.0)
    std = {n: shares.get(n, least) * f[1] for n, f in expected.figures.items() if f[1] > 0}
    return one.model_copy(update={"std": std})


def _sentence(expected: _Expected, parameters: Sequence[PlannedParameter], runs: int, basis: str) -> str:
    """The answer in one sentence."""
    name = expected.inputs.step.diagnosable.run if expected.inputs.step.diagnosable else "run"
    number = f"{runs} {name if runs == 1 else name + 's'}"
    lost = [p.name for p in parameters if not p.determined]
    source = "as in these logs" if basis == "logs" else "as planned"
    if refused := expected.result.refused:
        return f"{number} {source} give{'s' if runs == 1 else ''} no result: {refused[0].what}."
    verb = "determines" if runs == 1 else "determine"
    if lost:
        return f"{number} {source} {'does' if runs == 1 else 'do'} not determine {', '.join(lost)}."
    if not parameters:
        return f"{number} {source}: '{expected.inputs.step.name}' estimates no parameter; it tests the model."
    worst = max(parameters, key=lambda p: p.half95 / abs(p.value) if p.half95 and p.value else 0.0, default=None)
    if worst is None or not worst.value or not worst.half95:
        return f"{number} {source} {verb} every parameter."
    share = two_digits(100 * worst.half95 / abs(worst.value))
    return f"{number} {source} {verb} every parameter, the least accurate to {share} % ({worst.name}, 95 %)."
