"""The registration of the step ``cg``."""

from __future__ import annotations

from vdyn_cli.steps.cg.input_checks import track_check
from vdyn_cli.steps.cg.planned_logs import PLANNED
from vdyn_cli.steps.cg.policy import CG_POLICY
from vdyn_cli.steps.cg.problem import prepare
from vdyn_cli.steps.cg.run_clocks import CLOCKED
from vdyn_cli.steps.cg.spec import CgSpec
from vdyn_cli.steps.step_definition import Diagnosable, Step
from vdyn_cli.steps.step_policy import STEP_POLICY

SLOPE = ("tire_longitudinal_stiffness", "tire_relaxation_length")

STEP = Step(
    name="cg",
    situations=frozenset({"pitching"}),
    spec=CgSpec,
    policy=CG_POLICY,
    required=("time", "front_load|front_left_load+front_right_load", "acceleration", "pitch_rate|pitch"),
    optional=("pitch", "rear_load|rear_left_load+rear_right_load", "speed"),
    needs=(
        *("mass", "wheelbase", "antenna_height", "antenna_offset", "drag_area", "drag_height", "air_density"),
        *("wheel_inertia", "wheel_radius", "rolling_resistance"),
    ),
    gives=("cg_height", "cg_to_rear", "cg_to_front", "pitch_inertia"),
    reads=(
        "unsprung_mass_front",
        "unsprung_mass_rear",
        "tire_vertical_stiffness",
        *SLOPE,
        "brake_share_front",
        "wheels",
    ),
    fits_clocks=CLOCKED,
    longest_step=STEP_POLICY.sparse_samples,
    run_keys=("direction",),
    prepare=prepare,
    complete=("pitch_rate",),
    diagnosable=Diagnosable(metric=("front load", "N"), run="run"),
    track_check=track_check,
    planned=PLANNED,
)
