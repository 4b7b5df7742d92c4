"""The registration of the step ``tire``."""

from __future__ import annotations

from vdyn_cli.physics.models.tire_curve import SHAPE, SHIFTS
from vdyn_cli.steps.step_definition import Diagnosable, Step
from vdyn_cli.steps.tire.planned_logs import PLANNED
from vdyn_cli.steps.tire.policy import TIRE_POLICY
from vdyn_cli.steps.tire.problem import prepare
from vdyn_cli.steps.tire.result import STIFFNESS
from vdyn_cli.steps.tire.spec import TireSpec

STEP = Step(
    name="tire",
    situations=frozenset({"slip_sweep"}),
    spec=TireSpec,
    policy=TIRE_POLICY,
    required=("time", "force_x", "force_z"),
    optional=("slip", "wheel_speed", "vehicle_speed"),
    needs=("wheel_radius",),
    gives=(*SHAPE, STIFFNESS, *SHIFTS, "tire_B_brake", "tire_D_brake"),
    reads=SHAPE,
    run_keys=(),
    prepare=prepare,
    diagnosable=Diagnosable(metric=("force", "N"), run="sweep"),
    planned=PLANNED,
)
