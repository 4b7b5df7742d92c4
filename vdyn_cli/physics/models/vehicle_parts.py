"""Data of the vehicle's assembly: positions of the wheels, motion of the body, forces on it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

from vdyn_cli.engine.model_builder import Number


@dataclass(frozen=True)
class Corner:
    """Position of a wheel: ``name`` (suffix of its states), ``axle`` and ``side``."""

    name: str
    axle: str
    side: str


CORNERS = tuple(Corner(f"_{axle[0]}{side[0]}", axle, side) for axle in ("front", "rear") for side in ("left", "right"))


@dataclass(frozen=True)
class Body:
    """States of the chassis, SI, and quantities computed from them and the parameters.

    ``sprung_mass`` kg has its center ``sprung_to_front`` m behind the front axle; ``lightness`` m/s^2 is the reduction
    of gravity normal to the road by its slope, g (1 - cos).
    """

    speed: Number
    lateral_speed: Number
    heave: Number
    heave_rate: Number
    pitch: Number
    pitch_rate: Number
    roll: Number
    roll_rate: Number
    yaw: Number
    yaw_rate: Number
    sprung_mass: Number
    sprung_to_front: Number
    grade: Number
    lightness: Number


@dataclass(frozen=True)
class Forces:
    """Forces of the corners on the body: ``forward`` and ``left`` at the road, struts relative to rest (N); moments
    ``pitch`` nose-up, ``roll`` left side up, ``yaw`` to the left (N m); loads and half-shaft torques by corner."""

    forward: Number = 0.0
    left: Number = 0.0
    strut: Number = 0.0
    pitch: Number = 0.0
    roll: Number = 0.0
    yaw: Number = 0.0
    loads: Mapping[str, Number] = field(default_factory=dict)
    shafts: Mapping[str, Number] = field(default_factory=dict)

    def __add__(self, other: Forces) -> Forces:
        return Forces(
            self.forward + other.forward,
            self.left + other.left,
            self.strut + other.strut,
            self.pitch + other.pitch,
            self.roll + other.roll,
            self.yaw + other.yaw,
            {**self.loads, **other.loads},
            {**self.shafts, **other.shafts},
        )
