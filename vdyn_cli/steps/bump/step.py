"""The registration of the step ``bump``."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.physics.models.half_car import SOUGHT
from vdyn_cli.steps.bump.drop_problem import prepare_drop
from vdyn_cli.steps.bump.measured_profile import load
from vdyn_cli.steps.bump.planned_logs import PLANNED
from vdyn_cli.steps.bump.policy import BUMP_POLICY
from vdyn_cli.steps.bump.problem import prepare
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.step_definition import Diagnosable, Step

CAR = (
    *("mass", "sprung_mass", "unsprung_mass_front", "unsprung_mass_rear", "wheelbase", "cg_to_front", "cg_to_rear"),
    *("pitch_inertia", "sprung_pitch_inertia", "cg_height", "wheel_radius"),
)

CROSSING = Step(
    name="bump",
    situations=frozenset({"bump_crossing"}),
    spec=BumpSpec,
    policy=BUMP_POLICY,
    required=(
        *("time", "speed"),
        *("front_load|front_left_load+front_right_load", "rear_load|rear_left_load+rear_right_load"),
    ),
    optional=("vertical_acceleration", "pitch_rate"),
    needs=(*CAR, "wheel_mass", "antenna_offset"),
    gives=SOUGHT,
    reads=(),
    run_keys=(),
    prepare=prepare,
    diagnosable=Diagnosable(metric=("front load", "N"), run="crossing"),
    load=load,
    planned=PLANNED,
)

DROP = replace(
    CROSSING,
    required=("time",),
    optional=("body_height_front", "body_height_rear", "wheel_height_front", "wheel_height_rear"),
    needs=CAR,
    prepare=prepare_drop,
    diagnosable=Diagnosable(metric=("height", "m"), run="drop"),
    load=None,
    planned=None,
)

STEP = replace(CROSSING, manoeuvres={"drop": DROP})
