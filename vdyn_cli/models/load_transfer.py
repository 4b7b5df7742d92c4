"""Load transfer as a model: loads and motion in, the moment balance out. A static map."""

from __future__ import annotations

from vdyn_cli.elements.air import air
from vdyn_cli.elements.load_transfer import load_transfer
from vdyn_cli.engine.bench import Bench, Number, Signals
from vdyn_cli.engine.maths import GRAVITY
from vdyn_cli.engine.model import Model

GIVEN = ("mass", "wheelbase", "antenna_height", "antenna_offset", "drag_area", "drag_height", "air_density", "spin")
SOUGHT = ("cg_height", "cg_to_rear", "pitch_inertia")
ZEROS = ("front_load_zero", "rear_load_zero", "acceleration_zero")


def _balance(e: Bench, u: Signals, front: Number, rear: Number) -> None:
    p = e.p
    drag = e(air, speed=u.speed, wind=0.0, drag_area=p.drag_area, air_density=p.air_density)
    moment = e(
        load_transfer,
        front_load=front,
        rear_load=rear,
        acceleration=e("acceleration", value=u.acceleration) - p.acceleration_zero,
        pitch_rate=u.pitch_rate,
        pitch_acceleration=u.pitch_acceleration,
        drag=drag,
        **{name: getattr(p, name) for name in (*SOUGHT, *GIVEN) if name not in ("drag_area", "air_density")},
    )
    e.sensor("balance", moment, 0.0)


def _both(e: Bench, u: Signals) -> None:
    front = e("front_load", value=u.front_load) - e.p.front_load_zero
    rear = e("rear_load", value=u.rear_load) - e.p.rear_load_zero
    _balance(e, u, front, rear)


def _front(e: Bench, u: Signals) -> None:
    front = e("front_load", value=u.front_load) - e.p.front_load_zero
    _balance(e, u, front, e.p.mass * GRAVITY - front)


_MOTION = ("acceleration", "pitch_rate", "pitch_acceleration", "speed")

LOAD_TRANSFER = Model("load_transfer", _both, (*SOUGHT, *GIVEN, *ZEROS), ("front_load", "rear_load", *_MOTION))

# The paper's equation (5): without the rear axle's load the body is taken not to heave.
FRONT_LOAD_TRANSFER = Model(
    "front_load_transfer", _front, (*SOUGHT, *GIVEN, "front_load_zero", "acceleration_zero"), ("front_load", *_MOTION)
)
