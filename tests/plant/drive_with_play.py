"""Drives of another car than ``drive``'s: its tires, its half-shafts' play and its idle torque follow other laws.

* Tires damp at rest by a force of k v_s (1 + cos(pi v / V)) / 2 below V = 2.5 m/s, with k = 770 N s/m a wheel (Pacejka,
  Tire and Vehicle Dynamics, 3rd ed., section 8.6): a fifth to a third of what the treads of ``drive_motion`` do.
* Flanks of a half-shaft damp in proportion to their indentation up to 0.1 mrad, and rest against each other at first.
* The released pedal brakes: 8 N m while the car rolls. A standing car's motor pulls by 1.5 N m, forward or backward.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from math import atan, copysign, cos, pi, sin

from tests.plant import drive
from tests.plant.drive import Run
from tests.plant.drive_motion import Drive, Pedals
from tests.plant.vehicle import Vehicle

DAMPING, FADED = 770.0, 2.5  # N s/m of a wheel at rest; m/s
INDENTED = 1e-4  # rad
RELEASED, STANDING = -8.0, 1.5  # N m at the planetary output


class LooseDrive(Drive):
    """The equations of motion of one drive."""

    def tire(self, load: float, slip: float, sliding: float, speed: float) -> float:
        car, still = self.car, 0.5 + 0.5 * cos(pi * min(abs(speed) / FADED, 1.0))
        b = car.tire_B * slip + DAMPING * still * sliding / (max(load, 100.0) * car.tire_C * car.tire_D)
        return max(load, 0.0) * car.tire_D * sin(car.tire_C * atan(b - car.tire_E * (b - atan(b))))

    def shaft(self, side: int, twist: float, rate: float) -> float:
        gap, stiffness, damping = self.q["backlash"], self.stiffness[side], self.damping[side]
        if not gap:
            return stiffness * twist + damping * rate
        depth, way = max(abs(twist) - gap, 0.0), copysign(1.0, twist)
        return way * max(stiffness * depth + min(depth / INDENTED, 1.0) * damping * way * rate, 0.0)

    def rest(self, position: float) -> list[float]:
        state, torque = super().rest(position), 0.5 * self.pedals.at(0.0)[0] * self.car.gear_ratio
        for side, stiffness in enumerate(self.stiffness):
            state[14 + side] = copysign(self.q["backlash"], torque) + torque / stiffness
        return state


def pedals(vehicle: Vehicle, seed: int, count: int = 3) -> list[Pedals]:
    """Those of ``drive``, with this car's torques where the pedal is released."""
    return [
        _idling(one, STANDING if k % 2 == 0 else -STANDING) for k, one in enumerate(drive.pedals(vehicle, seed, count))
    ]


def _idling(one: Pedals, standing: float) -> Pedals:
    first = next(k for k, torque in enumerate(one.drive) if torque > 0.0)
    last = len(one.drive) - 2  # the brake holds the car from here on
    torques = (
        torque or (standing if k < first else STANDING if k >= last else RELEASED) for k, torque in enumerate(one.drive)
    )
    return replace(one, drive=tuple(torques))


def campaign(vehicle: Vehicle, seed: int, effects: Mapping[str, float] | None = None) -> tuple[Run, ...]:
    """The drives as logged, from a seed."""
    return drive.logged(vehicle, pedals(vehicle, seed), seed, effects, motion=LooseDrive)
