"""How far an assumed parameter may be off: the standard deviations of what nobody measured."""

from __future__ import annotations

from collections.abc import Mapping

# Relative where a value is far from zero, in SI where it is zero (``ABSOLUTE``). What is not named is taken as exact.
RELATIVE: Mapping[str, float] = {
    "unsprung_mass_front": 0.2,
    "unsprung_mass_rear": 0.2,
    "tire_relaxation_length": 0.4,
    "drag_height": 0.15,
    "driveline_efficiency": 0.01,
    "air_density": 0.02,
    "driveline_inertia": 0.1,
    "shaft_damping_left": 0.4,
    "shaft_damping_right": 0.4,
    "brake_share_front": 0.08,
    "hub_swing": 1.0,
    "driveline_pitch": 1.0,
    "rotating_mass": 0.3,
}
ABSOLUTE: Mapping[str, float] = {
    "tire_load_sensitivity": 2e-5,  # 1/N: friction falls by 0 to 4 % per kN
    "tire_vertical_damping": 100.0,  # N s/m: a few per cent of critical for the wheel hop
}
# Of no effect on a straight and level drive: assuming them needs no line in the report.
UNFELT = frozenset(
    {"roll_inertia", "yaw_inertia", "track_front", "track_rear", "tire_cornering_stiffness", "tire_vertical_damping",
     "rolling_speed", "wind_variance", "cg_to_front", "drag_area"}
)  # fmt: skip


def assumed_std(name: str, value: float) -> float:
    """Standard deviation of an assumed value, SI."""
    return ABSOLUTE.get(name, RELATIVE.get(name, 0.0) * abs(value))
