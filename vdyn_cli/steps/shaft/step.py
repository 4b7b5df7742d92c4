"""The registration of the step ``shaft``."""

from __future__ import annotations

from vdyn_cli.steps.scaled_channel import torque_at_wheel
from vdyn_cli.steps.shaft.planned_logs import PLANNED
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.problem import prepare
from vdyn_cli.steps.shaft.spec import ShaftSpec
from vdyn_cli.steps.step_definition import Diagnosable, Step

STEP = Step(
    name="shaft",
    situations=frozenset({"shaft_twist"}),
    spec=ShaftSpec,
    policy=SHAFT_POLICY,
    required=("time", "shaft_torque"),
    optional=("twist", "motor_speed", "wheel_speed", "motor_angle", "wheel_angle"),
    needs=(),
    gives=("shaft_stiffness_left", "shaft_stiffness_right", "shaft_damping_left", "shaft_damping_right"),
    scaled=(torque_at_wheel("shaft_torque"),),
    reads=("shear_modulus",),
    run_keys=(),
    prepare=prepare,
    unbroken=("shaft_torque", "twist", "motor_speed", "wheel_speed"),
    diagnosable=Diagnosable(metric=("shaft torque", "N m"), run="tip-in"),
    planned=PLANNED,
)
