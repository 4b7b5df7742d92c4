"""What is hidden, where, how large, and what the program should say of it: the rows of the hidden-effect matrix.

Sizes are what test engineers meet, chosen towards the small end: for a usual vehicle the Cramer-Rao t is near 10 where
that is plausible. Some effects are much larger than these sensors need (``usual``): then a verdict is easy and the
size, and the model around it, must be right to a part in a hundred or better.

Expectations: ``named`` the effect, or a set that these data can't tell it from; ``both`` of two; ``class`` a set that
no data of this kind can tell apart, never one of it alone; ``unknown`` something is wrong that no cause explains;
``nothing``; ``not_testable`` nothing is claimed; ``fault`` a broken sensor is refused or said.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from typing import Literal

Expect = Literal["named", "both", "class", "unknown", "nothing", "not_testable", "fault"]


@dataclass(frozen=True, eq=False)
class Cell:
    """One row: ``effects`` hidden in the logs of ``step`` run as ``variant`` (tests.plant.hidden.VARIANTS)."""

    step: str
    variant: str
    effects: Mapping[str, float]
    expect: Expect
    fault: str = ""
    fast: bool = field(default=False)  # runs with the tests; coast-downs: test_coastdown_diagnosis.py

    @property
    def name(self) -> str:
        inside = " and ".join(f"{name} {size:g}" for name, size in self.effects.items()) or self.fault or "nothing"
        return f"{self.step}{f' ({self.variant})' if self.variant else ''}: {inside}"


def _each(step: str, variant: str, expect: Expect, **sizes: float) -> Iterator[Cell]:
    for effect, size in sizes.items():
        yield Cell(step, variant, {effect: size}, expect)


def _pair(step: str, variant: str, **sizes: float) -> Cell:
    return Cell(step, variant, sizes, "both")


COASTDOWN = (
    Cell("coastdown", "wide", {"headwind": 1.0}, "named"),
    *_each("coastdown", "wide", "named", road_grade=4e-4, grade_profile=1.5e-3, speed_dependent_rolling=1.2e-4),
    *_each("coastdown", "wide", "named", tire_warmup=0.2, brake_drag_fading=90.0),
    *_each("coastdown", "warm", "named", temperature_rolling=0.006),
    *_each("coastdown", "fixed", "named", headwind=1.0, brake_drag_fading=60.0),
    *_each("coastdown", "eight", "named", headwind=1.4, road_grade=6e-4),
    *_each("coastdown", "powered", "named", headwind=1.5),
    *_each("coastdown", "powered", "class", speed_delay=0.03),  # a torque that comes early
    # With the drag coefficient fixed, all that scales the forces looks like drag that the tester does not know of.
    *_each("coastdown", "fixed", "class", extra_drag_area=0.05, rotating_mass=100.0, mass_error=0.08),
    *_each("coastdown", "powered", "class", torque_gain=0.01, wheel_radius=0.01, mass_error=0.012, rotating_mass=18.0),
    *_each("coastdown", "wide", "unknown", drag_bump=25.0),
    *_each("coastdown", "fixed", "unknown", drag_bump=25.0),
    *_each("coastdown", "powered", "unknown", drag_bump=40.0),
    _pair("coastdown", "wide", headwind=1.5, tire_warmup=0.3),
    _pair("coastdown", "wide", headwind=1.5, brake_drag_fading=130.0),
    _pair("coastdown", "wide", road_grade=6e-4, tire_warmup=0.3),
    *_each("coastdown", "wide", "not_testable", extra_drag_area=0.1, brake_drag=40.0, driveline_drag=40.0),
    *_each("coastdown", "wide", "not_testable", rotating_mass=80.0, speed_delay=0.15),
    # Speed and the logged position contradict each other: one of the sensors has a wrong gain.
    *_each("coastdown", "wide", "fault", speed_scale=0.03),
    *_each("coastdown", "fixed", "fault", speed_scale=0.07),
    *_each("coastdown", "one_way", "not_testable", road_grade=1e-3, headwind=2.0),
    *_each("coastdown", "powered", "not_testable", torque_offset=3.0),
    Cell("coastdown", "wide", {}, "nothing"),
    *(Cell("coastdown", variant, {}, "nothing") for variant in ("warm", "fixed", "eight", "short", "powered")),
    Cell("coastdown", "one_way", {}, "not_testable"),
    Cell("coastdown", "wide", {}, "fault", "stuck"),
)

CG = (
    *_each("cg", "", "named", clock_offset=1e-3, acceleration_delay=4e-3, acceleration_lag=0.03),
    *_each("cg", "", "named", unsprung_mass=100.0, aero_lift=0.6),
    *_each("cg", "", "named", load_crosstalk=0.02),
    Cell("cg", "", {"road_grade": 0.02}, "named", fast=True),
    *_each("cg", "", "not_testable", accelerometer_tilt=0.005, accelerometer_offset=0.05, wheel_force_gain=0.01),
    *_each("cg", "", "not_testable", pitch_rate_gain=0.03, wheel_force_gain_front=0.01),
    *_each("cg", "", "not_testable", pitch_axis=0.12),  # every car has one: the fit includes it
    *_each("cg", "", "unknown", load_compression=0.06),
    _pair("cg", "", clock_offset=2e-3, road_grade=0.03),
    Cell("cg", "", {}, "nothing"),
    Cell("cg", "", {}, "fault", "stuck"),
)

BUMP = (
    *_each("bump", "", "named", asymmetric_damping=0.02, suspension_friction=8.0, progressive_spring=0.15),
    *_each("bump", "", "named", tire_damping=20.0, tire_enveloping=0.03, speed_error=2e-3, clock_offset=5e-4),
    # usual
    Cell("bump", "", {"asymmetric_damping": 0.35}, "named", fast=True),
    *_each("bump", "", "named", suspension_friction=150.0, progressive_spring=3.0, tire_damping=300.0),
    *_each("bump", "", "named", tire_enveloping=0.1, speed_error=0.02, clock_offset=5e-3),
    *_each("bump", "", "named", bump_height_error=0.02, bump_width_error=0.02, bump_trapezoid=0.1),
    Cell("bump", "", {"wheel_circle": 1.0}, "named"),
    *_each("bump", "", "unknown", degressive_damping=0.1),
    _pair("bump", "", asymmetric_damping=0.3, suspension_friction=100.0),
    _pair("bump", "", asymmetric_damping=0.3, speed_error=0.01),
    Cell("bump", "", {}, "nothing"),
    Cell("bump", "", {}, "fault", "stuck"),
)

INERTIA = (
    Cell("inertia", "", {"bearing_drag": 0.2}, "named", fast=True),
    *_each("inertia", "", "named", clock_offset=5e-3, hub_torque_delay=5e-3, hub_torque_lag=5e-3),
    *_each("inertia", "", "class", hub_torque_gain=5e-3, wheel_radius=5e-3, wheel_mass=2.0),
    *_each("inertia", "", "class", brake_drag=20.0, hub_torque_offset=20.0),
    *_each("inertia", "", "not_testable", hub_torque_offset=1.0),
    *_each("inertia", "", "unknown", drag_bump=3.0),
    _pair("inertia", "", bearing_drag=0.1, clock_offset=0.01),
    Cell("inertia", "", {}, "nothing"),
    Cell("inertia", "", {}, "fault", "stuck"),
)

TIRE = (
    *_each("tire", "", "named", load_sensitivity=4e-6, slip_offset=1.5e-3, force_offset=8.0),
    *_each("tire", "", "named", tire_relaxation=0.2, friction_fade=5e-3),
    # usual
    Cell("tire", "", {"load_sensitivity": 2e-5}, "named", fast=True),
    *_each("tire", "", "named", slip_offset=0.01, force_offset=40.0, load_offset=80.0, friction_fade=0.02),
    *_each("tire", "", "named", braking_friction=0.05, vertical_crosstalk=0.02),
    *_each("tire", "", "unknown", stiffness_load=1e-4),
    *_each("tire", "", "named", rolling_force=-0.02),  # the same as a vertical shift Sv = 0.02
    _pair("tire", "", load_sensitivity=2e-5, force_offset=30.0),
    Cell("tire", "", {}, "nothing"),
    Cell("tire", "", {}, "fault", "stuck"),
)

SHAFT = (
    Cell("shaft", "", {"backlash": 2e-4}, "named", fast=True),
    *_each("shaft", "", "named", backlash=2e-3),  # usual
    *_each("shaft", "drawn", "named", series_compliance=5e-6),
    *_each("shaft", "", "not_testable", series_compliance=5e-6, damping=20.0),
    *_each("shaft", "", "unknown", stiffening=200.0),
    Cell("shaft", "", {}, "nothing"),
    Cell("shaft", "drawn", {}, "nothing"),
    Cell("shaft", "", {}, "fault", "stuck"),
)

VALIDATE = (
    *_each("validate", "", "named", extra_drag_area=0.13, headwind=2.0, road_grade=5e-4),
    *_each("validate", "", "not_testable", grade_profile=6e-4),  # where on the road a drive begins is not logged
    *_each("validate", "", "named", speed_dependent_rolling=1e-4, tire_warmup=0.3, brake_drag=30.0),
    *_each("validate", "", "named", brake_drag_fading=25.0, driveline_drag=15.0, mass_error=0.03, wheel_radius=0.012),
    *_each("validate", "", "named", shaft_stiffness=0.25, shaft_damping=0.8, tire_relaxation=1.0, motor_inertia=1.0),
    *_each("validate", "", "named", backlash=1e-3, torque_gain=5e-3, torque_offset=1.5, torque_delay=5e-3),
    *_each("validate", "", "named", speed_scale=0.01, speed_delay=0.01),
    # Rotating mass sits at the wheels: it is their inertia.
    *_each("validate", "", "class", rotating_mass=16.0, wheel_inertia=0.25),
    *_each("validate", "", "unknown", drag_bump=60.0),
    _pair("validate", "", driveline_drag=40.0, torque_gain=0.01),
    _pair("validate", "", road_grade=1e-3, motor_inertia=1.5),
    Cell("validate", "", {}, "nothing"),
    Cell("validate", "", {}, "fault", "stuck"),
)

CASES: tuple[Cell, ...] = (*COASTDOWN, *CG, *BUMP, *INERTIA, *TIRE, *SHAFT, *VALIDATE)
