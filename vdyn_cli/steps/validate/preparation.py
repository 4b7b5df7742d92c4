"""Preparation of a validation: of whole drives, or of powered windows in place of long ones."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from vdyn_cli.io.quality.acceleration_mistake import without_mistaken_acceleration
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.constants import USUAL_WHEELS
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.failure import no_runs
from vdyn_cli.steps.validate.car.prior import parameter_prior, resistances
from vdyn_cli.steps.validate.car.start_speeds import rms_speed_error
from vdyn_cli.steps.validate.drives.engine_turns import with_engine_turns
from vdyn_cli.steps.validate.drives.late_speed import with_speed_on_time
from vdyn_cli.steps.validate.input_checks import is_long_trip
from vdyn_cli.steps.validate.problem import ValidateProblem
from vdyn_cli.steps.validate.road.elevation_road import with_logged_elevation
from vdyn_cli.steps.validate.spec import ValidateSpec, WindowSettings


def prepare(spec: ValidateSpec, logs: Sequence[Log], known: Parameters) -> ValidateProblem:
    """The problem of drives against a model.

    Raises
    ------
    InputError : no run; a mass on a road lacks parameters, read before its roads are computed, which takes long; or
        the vehicle has more or fewer wheels than its model.
    """
    if spec.settings.model == "road_load":
        parameter_prior(known, road_load("torque", resistances=resistances(known)).parameters)
    elif (wheels := known.value("wheels", USUAL_WHEELS)) != USUAL_WHEELS:
        remedy = "set 'settings: {model: road_load}', which needs no single wheels"
        raise InputError(Finding("vehicle.wheels", "the vehicle's model has four wheels", f"{wheels:g}", remedy))
    if not logs:
        raise no_runs("validate")
    right, findings = without_mistaken_acceleration(logs, or_speed=False)
    if spec.settings.model == "road_load":
        right, late = with_speed_on_time(right)
        right, findings = with_engine_turns(right), (*findings, *late)
    return with_logged_elevation(ValidateProblem(spec, right, known, findings=findings))


def powered_windows(problem: ValidateProblem) -> tuple[ValidateSpec, ValidateProblem] | None:
    """Powered windows instead of the long drives of a problem, if the car follows its torque in every drive."""
    s = problem.spec.settings
    if s.windows or not is_long_trip(problem.baseline.segments):
        return None
    spec = problem.spec.model_copy(update={"settings": s.model_copy(update={"windows": WindowSettings()})})
    return spec, replace(problem, spec=spec, missed=rms_speed_error(problem.baseline))
