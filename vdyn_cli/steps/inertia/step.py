"""The registration of the step ``inertia``."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.physics.models.free_wheel import DRAG
from vdyn_cli.steps.inertia.planned_logs import PLANNED
from vdyn_cli.steps.inertia.policy import INERTIA_POLICY
from vdyn_cli.steps.inertia.problem import load, prepare
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.inertia.stand_problem import prepare_stand
from vdyn_cli.steps.scaled_channel import torque_at_wheel
from vdyn_cli.steps.step_definition import Diagnosable, Step
from vdyn_cli.steps.step_policy import STEP_POLICY

ON_ROAD = Step(
    name="inertia",
    situations=frozenset({"wheel_spin", "rolling_wheel_spin"}),
    spec=InertiaSpec,
    policy=INERTIA_POLICY,
    required=("time", "hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration"),
    optional=("vehicle_speed",),
    needs=("wheel_mass", "wheel_radius", "rolling_resistance"),
    gives=("wheel_inertia", *DRAG),
    scaled=(torque_at_wheel("hub_torque"),),
    reads=(),
    longest_step=STEP_POLICY.sparse_samples,
    run_keys=(),
    prepare=prepare,
    diagnosable=Diagnosable(metric=("wheel speed", "rad/s"), run="drive"),
    load=load,
    planned=PLANNED,
)

ON_STAND = replace(
    ON_ROAD,
    situations=frozenset({"wheel_spin", "free_wheel_spin"}),
    required=("time", "hub_torque", "wheel_speed"),
    optional=(),
    needs=(),
    prepare=prepare_stand,
    diagnosable=Diagnosable(metric=("wheel speed", "rad/s"), run="spin"),
    load=None,
    planned=None,
)

STEP = replace(ON_ROAD, manoeuvres={"stand": ON_STAND})
