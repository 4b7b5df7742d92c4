"""The step ``validate``."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.quantities.parameters import ESTIMATED_BY
from vdyn_cli.steps.scaled_channel import SPEED_OF_WHEEL, TORQUE_OF_MOTOR
from vdyn_cli.steps.step_definition import Diagnosable, Step
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.validate.drives.complete_inputs import DRIVE_TORQUES, FEWEST_SAMPLES, INPUTS, OUTPUTS
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.preparation import powered_windows, prepare
from vdyn_cli.steps.validate.problem import ValidateProblem
from vdyn_cli.steps.validate.spec import ValidateSpec

MOST_GAIN = 15.0  # of a speed by its unit, ratio or pulses a turn, as far as the candidate effect reaches
SHORTEST_DRIVE = 5.0  # s, least length of a drive: in a shorter one, start speed and torque zero fit like any force


def too_short(problem: ValidateProblem) -> str:
    """Why no drive is long enough; empty where one is."""
    longest = max((log.duration for log in problem.logs), default=0.0)
    return "" if longest >= SHORTEST_DRIVE else f"no drive lasts longer than {longest:.2g} s"


STEP = Step(
    name="validate",
    situations=frozenset({"driving", "open_road"}),
    spec=ValidateSpec,
    policy=VALIDATE_POLICY,
    required=("time", "speed", "drive_torque|drive_torque_left+drive_torque_right"),
    optional=("brake_torque", *OUTPUTS[1:], "jerk", "grade", "elevation", "wind_speed", "motor_speed"),
    needs=tuple(ESTIMATED_BY),
    gives=(),
    scaled=(replace(SPEED_OF_WHEEL, in_model=True), TORQUE_OF_MOTOR),
    any_gain={"speed": MOST_GAIN},
    longest_step=STEP_POLICY.sparse_samples,
    run_keys=("direction", "start", "temperature"),
    prepare=prepare,
    complete=(*DRIVE_TORQUES, *INPUTS),
    unbroken=("speed",),
    fewest_rows=FEWEST_SAMPLES,
    diagnosable=Diagnosable(
        metric=("speed", "m/s"),
        run="drive",
        too_short=too_short,
        # Drives are along one road only if every drive states its direction.
        two_way=lambda spec: all(r.direction for r in spec.runs),
        linearized=lambda spec: True,
        narrower=powered_windows,
        carries=True,
    ),
)
