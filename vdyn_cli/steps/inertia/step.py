"""The registration of the step ``inertia``."""

from __future__ import annotations

from vdyn_cli.steps.contract import Diagnosable, Step
from vdyn_cli.steps.inertia.problem import load, prepare
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.scaled_channel import torque_at_wheel

STEP = Step(
    name="inertia",
    situations=frozenset({"wheel_spin"}),
    spec=InertiaSpec,
    required=("time", "hub_torque", "wheel_speed", "hub_force_x", "hub_force_z", "acceleration"),
    optional=("vehicle_speed",),
    needs=("wheel_mass", "wheel_radius", "rolling_resistance"),
    gives=("wheel_inertia",),
    scaled=(torque_at_wheel("hub_torque"),),
    prepare=prepare,
    diagnosable=Diagnosable(metric=("wheel speed", "rad/s"), run="drive"),
    load=load,
)
