"""Messy days of the plant as a tester hands them to the coast-down step."""

from __future__ import annotations

from typing import Any

from tests.plant.messy_day import Case
from vdyn_cli.diagnosis.diagnose import diagnosed
from vdyn_cli.diagnosis.diagnosis_setup import PreparedStep
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.coastdown.step import STEP


def prepared(case: Case, position: bool, split_times: bool = False, **settings: Any) -> PreparedStep:
    """The step with what a tester states: mass, rotating mass and air density, directions and start times.

    ``split_times``: the runs are the instants at which levels of speed were passed.
    """
    logs = []
    for k, run in enumerate(case.runs, start=1):
        place = {"position": run.position} if position else {}
        logs.append(Log(f"run_{k}.csv", run.time, {"speed": run.speed, **place}))
    runs = [
        {"log": log.name, "direction": run.direction, "start": run.start}
        for log, run in zip(logs, case.runs, strict=True)
    ]
    reading = {"reading": {"split_times": "elapsed"}} if split_times else {}
    spec = CoastdownSpec.model_validate({"test": "coastdown", "runs": runs, "settings": settings, **reading})
    names = ("mass", "rotating_mass", "air_density")
    known = Parameters({n: Estimate.given(PARAMETERS[n], getattr(case.vehicle, n)) for n in names})
    return PreparedStep(STEP, spec, known, STEP.prepare(spec, tuple(logs), known))


def estimated(case: Case, position: bool, **settings: Any) -> Result:
    """The baseline's result."""
    return prepared(case, position, **settings).problem.publish()


def diagnosed_case(case: Case, position: bool, **settings: Any) -> Result:
    """The result with its diagnosis."""
    ready = prepared(case, position, **settings)
    return diagnosed(ready, ready.problem.publish())
