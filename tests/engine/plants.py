"""Small models for the engine's tests: a road load, and a half car whose tires lift off."""

from __future__ import annotations

import math

from vdyn_cli.engine.maths import both, cos, fabs, fmax, sin, where
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Number, Signals
from vdyn_cli.quantities.constants import GRAVITY


def air(s: Signals) -> Number:
    flow = s.speed + s.wind
    return 0.5 * s.air_density * s.drag_area * flow * fabs(flow)


def rolling(s: Signals) -> Number:
    return s.rolling_resistance * s.load


def damper(s: Signals) -> Number:
    return s.damping * s.stroke_rate


def tire_vertical(s: Signals) -> Number:
    return fmax(s.static_load - s.stiffness * s.deflection, 0.0)


def _road_load(e: ModelBuilder, u: Signals) -> None:
    p, v, _ = e.p, e.state("speed", 20.0), e.state("position")
    drag = e(air, speed=v, wind=u.wind, drag_area=p.drag_area, air_density=p.air_density)
    drag += e(rolling, speed=v, load=p.mass * GRAVITY * cos(u.grade), rolling_resistance=p.rolling_resistance)
    force = e("drive_force", value=u.drive_force) - drag - p.mass * GRAVITY * sin(u.grade)
    e.integrate(speed=force / (p.mass + p.rotating_mass), position=v)
    e.sensor("speed", v)


ROAD_LOAD = Model(
    "road_load",
    _road_load,
    ("mass", "rotating_mass", "drag_area", "air_density", "rolling_resistance"),
    ("drive_force", "wind", "grade"),
    ("heading",),
)
ROAD = {"mass": 1500.0, "rotating_mass": 45.0, "drag_area": 0.6, "air_density": 1.2, "rolling_resistance": 0.01}


def _half_car(e: ModelBuilder, u: Signals) -> None:
    p = e.p
    z, w, pitch, turn, x = (e.state(name) for name in ("heave", "heave_rate", "pitch", "pitch_rate", "position"))
    lift: Number = 0.0
    moment: Number = 0.0
    front = ("_front", p.cg_to_front, p.cg_to_rear, p.stiffness_front, p.damping_front, p.unsprung_front, p.bump_front)
    rear = ("_rear", -p.cg_to_rear, p.cg_to_front, p.stiffness_rear, p.damping_rear, p.unsprung_rear, p.bump_rear)
    for at, arm, other, stiffness, damping, mass, bump in (front, rear):
        y, v = e.state("wheel" + at), e.state("wheel_rate" + at)
        strut = stiffness * (z + arm * pitch - y) + e(damper, at, stroke_rate=w + arm * turn - v, damping=damping)
        phase = (x - bump) / 0.48
        road = where(both(phase > 0, phase < 1), 0.035 * (1 - cos(2 * math.pi * phase)), 0.0)
        static = p.sprung_mass * GRAVITY * other / (p.cg_to_front + p.cg_to_rear) + mass * GRAVITY
        load = e(tire_vertical, at, static_load=static, stiffness=p.tire_stiffness, deflection=y - road)
        e.integrate(**{"wheel" + at: v, "wheel_rate" + at: (strut + load - static) / mass})
        e.sensor("load" + at, load)
        lift, moment = lift - strut, moment - arm * strut
    e.integrate(heave=w, heave_rate=lift / p.sprung_mass, pitch=turn, pitch_rate=moment / p.pitch_inertia)
    e.integrate(position=u.speed)


HALF = {
    "sprung_mass": 1400.0,
    "pitch_inertia": 2100.0,
    "cg_to_front": 1.25,
    "cg_to_rear": 1.45,
    "unsprung_front": 80.0,
    "unsprung_rear": 80.0,
    "stiffness_front": 45e3,
    "stiffness_rear": 42e3,
    "damping_front": 3200.0,
    "damping_rear": 3000.0,
    "tire_stiffness": 4e5,
    "bump_front": 5.0,
    "bump_rear": 7.7,
}
HALF_CAR = Model("half_car", _half_car, tuple(HALF), ("speed",))
