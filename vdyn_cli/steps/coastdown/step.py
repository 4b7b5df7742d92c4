"""The step ``coastdown``."""

from __future__ import annotations

from vdyn_cli.steps.coastdown.campaign_checks.planned_logs import PLANNED
from vdyn_cli.steps.coastdown.campaign_checks.track_check import track_check
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.preparation import prepare
from vdyn_cli.steps.coastdown.problem import CoastdownProblem
from vdyn_cli.steps.coastdown.spec import CoastdownSpec
from vdyn_cli.steps.scaled_channel import FORCE_OF_POWER, SPEED_OF_WHEEL, TORQUE_OF_MOTOR
from vdyn_cli.steps.step_definition import Diagnosable, Step

# Hz: the fit averages over 2 s (campaign.BIN_WIDTH), and the braking tests over tenths of a second. At 1 m/s^2 the
# speed changes by 0.05 m/s in a block, linearly with time.
RATE = 20.0


def _on_one_road(spec: CoastdownSpec) -> bool:
    """Whether the runs go to and fro on one road, so that wind and slope change sign with the direction."""
    return spec.settings.windows != "powered"


def _fitted_channel(problem: CoastdownProblem) -> tuple[str, str] | None:
    """The specific force where the speed is not fitted."""
    return None if problem.campaign.speed_fitted else ("acceleration", "m/s^2")


STEP = Step(
    name="coastdown",
    situations=frozenset({"coasting", "open_road"}),
    spec=CoastdownSpec,
    policy=COASTDOWN_POLICY,
    required=("time", "speed"),
    optional=("position", "drive_torque", "drive_force", "acceleration", "grade", "wind_speed", "elevation"),
    needs=("frontal_area",),  # wheel_inertia is used where it is given, but its step follows this one
    gives=(
        "rolling_resistance",
        "drag_area",
        "drag_coefficient",
        "road_load_f0",
        "road_load_f1",
        "road_load_f2",
    ),
    scaled=(SPEED_OF_WHEEL, TORQUE_OF_MOTOR, FORCE_OF_POWER),
    reads=(
        *("mass", "rotating_mass", "wheels", "wheel_inertia", "wheel_radius", "gear_ratio", "driveline_efficiency"),
        *("air_density", "temperature", "pressure"),
    ),
    run_keys=("direction", "start", "temperature", "wind_speed", "crosswind"),
    prepare=prepare,
    rate=lambda spec: RATE,
    track_check=track_check,
    diagnosable=Diagnosable(
        metric=("speed", "m/s"),
        metric_of=_fitted_channel,
        run="coast-down",
        fewest_runs=4,
        two_way=_on_one_road,
    ),
    planned=PLANNED,
)
