"""The true vehicle: one frozen record of every parameter, the reference car, and a plausible random one."""

# ruff: noqa: N815 (tire_B ... tire_E are the names of the results)
from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

GRAVITY = 9.80665  # m/s^2
AIR_DENSITY = 1.225  # kg/m^3, of the reference conditions


@dataclass(frozen=True)
class Vehicle:
    """A Prius-class car in SI units; stiffness and damping of the suspension and of the tires are per axle.

    Two axles of unsprung mass ride at the height of the wheel centers, and they are shared out so that the sprung
    body's center lies above the same point of the road as the whole car's.
    """

    mass: float = 1588.0
    wheelbase: float = 2.70
    track_front: float = 1.525
    track_rear: float = 1.520
    cg_to_rear: float = 1.45
    cg_height: float = 0.61  # of the whole car
    pitch_inertia: float = 2200.0  # of the whole car about its center, wheels not pitching along
    antenna_height: float = 1.52
    frontal_area: float = 2.19
    drag_coefficient: float = 0.25
    drag_height: float = 0.58
    rolling_resistance: float = 0.0095
    unsprung_mass_front: float = 82.0
    suspension_stiffness_front: float = 44_000.0
    suspension_stiffness_rear: float = 41_000.0
    suspension_damping_front: float = 3_200.0
    suspension_damping_rear: float = 2_900.0
    tire_vertical_stiffness: float = 400_000.0
    tire_damping: float = 0.0
    wheel_radius: float = 0.308
    wheel_mass: float = 20.0
    wheel_inertia: float = 1.25  # of one wheel
    driveline_inertia: float = 3.3  # motor-generators and differential, seen at the driven wheels together
    side_gear_inertia: float = 0.004  # of that: each side gear of the differential with its joint
    differential_locked: bool = False
    gear_ratio: float = 3.267  # planetary output to driven wheels; motors turn so much faster, the same way
    tire_B: float = 12.0
    tire_C: float = 1.6
    tire_D: float = 1.0
    tire_E: float = 0.3
    tire_relaxation_length: float = 0.25
    shaft_stiffness_left: float = 29_292.0
    shaft_stiffness_right: float = 16_576.0
    shaft_damping_left: float = 60.0
    shaft_damping_right: float = 45.0
    shear_modulus: float = 79.3e9

    @property
    def cg_to_front(self) -> float:
        return self.wheelbase - self.cg_to_rear

    @property
    def drag_area(self) -> float:
        return self.drag_coefficient * self.frontal_area

    @property
    def unsprung_mass_rear(self) -> float:
        return self.unsprung_mass_front * self.cg_to_front / self.cg_to_rear

    @property
    def unsprung_mass(self) -> float:
        return self.unsprung_mass_front + self.unsprung_mass_rear

    @property
    def sprung_mass(self) -> float:
        return self.mass - self.unsprung_mass

    @property
    def sprung_height(self) -> float:
        """Height of the sprung body's center: the whole car's less the axles at wheel-center height."""
        return (self.mass * self.cg_height - self.unsprung_mass * self.wheel_radius) / self.sprung_mass

    @property
    def sprung_pitch_inertia(self) -> float:
        """Of the sprung body about its own center (the half car's); the whole car's adds the height between them."""
        lever = self.sprung_height - self.wheel_radius
        return self.pitch_inertia - self.sprung_mass * self.unsprung_mass / self.mass * lever**2

    @property
    def rotating_mass(self) -> float:
        """What four wheels and the coupled motor-generators add to the inertia of the rolling car, kg."""
        return (4 * self.wheel_inertia + self.driveline_inertia) / self.wheel_radius**2

    @property
    def front_load(self) -> float:
        """Static load of the front axle, N."""
        return self.mass * GRAVITY * self.cg_to_rear / self.wheelbase

    @property
    def rear_load(self) -> float:
        return self.mass * GRAVITY * self.cg_to_front / self.wheelbase

    @property
    def tire_longitudinal_stiffness(self) -> float:
        """Slope of Fx/Fz against slip at zero slip."""
        return self.tire_B * self.tire_C * self.tire_D

    def but(self, **changed: float) -> Vehicle:
        return replace(self, **changed)


REFERENCE = Vehicle()


def random_vehicle(seed: int) -> Vehicle:
    """A passenger car unlike any other: every parameter drawn from a plausible range, related ones together."""
    rng = np.random.default_rng([seed, 0x5EED])

    def between(low: float, high: float) -> float:
        return float(rng.uniform(low, high))

    def around(value: float, spread: float) -> float:
        return float(value * np.exp(rng.uniform(-spread, spread)))

    mass = between(1150.0, 2150.0)
    size = mass / REFERENCE.mass
    wheelbase = between(2.45, 2.90)
    cg_to_rear = wheelbase * between(0.46, 0.60)
    height = between(0.50, 0.68)
    radius = between(0.290, 0.345)
    front = mass * cg_to_rear / wheelbase
    rear = mass - front
    hertz_front, hertz_rear = between(1.15, 1.55), between(1.25, 1.70)
    stiffness_front = 0.92 * front * (2 * np.pi * hertz_front) ** 2
    stiffness_rear = 0.92 * rear * (2 * np.pi * hertz_rear) ** 2
    return Vehicle(
        mass=mass,
        wheelbase=wheelbase,
        track_front=between(1.46, 1.60),
        track_rear=between(1.46, 1.60),
        cg_to_rear=cg_to_rear,
        cg_height=height,
        pitch_inertia=mass * cg_to_rear * (wheelbase - cg_to_rear) * between(0.70, 0.90),
        antenna_height=between(1.42, 1.68),
        frontal_area=around(2.2, 0.15),
        drag_coefficient=between(0.22, 0.36),
        drag_height=between(0.48, 0.72),
        rolling_resistance=between(0.0065, 0.0145),
        unsprung_mass_front=around(80.0 * size, 0.15),
        suspension_stiffness_front=float(stiffness_front),
        suspension_stiffness_rear=float(stiffness_rear),
        suspension_damping_front=float(2 * between(0.22, 0.38) * np.sqrt(stiffness_front * 0.92 * front)),
        suspension_damping_rear=float(2 * between(0.22, 0.38) * np.sqrt(stiffness_rear * 0.92 * rear)),
        tire_vertical_stiffness=around(400_000.0 * size, 0.15),
        wheel_radius=radius,
        wheel_mass=around(20.0, 0.2),
        wheel_inertia=around(1.25, 0.3) * (radius / 0.308) ** 2,
        driveline_inertia=between(0.5, 4.0),
        gear_ratio=between(2.7, 4.3),
        tire_B=between(8.0, 16.0),
        tire_C=between(1.4, 1.75),
        tire_D=between(0.85, 1.10),
        tire_E=between(-0.6, 0.6),
        tire_relaxation_length=between(0.12, 0.40),
        shaft_stiffness_left=between(9_000.0, 32_000.0),
        shaft_stiffness_right=between(7_000.0, 30_000.0),
        shaft_damping_left=between(25.0, 90.0),
        shaft_damping_right=between(25.0, 90.0),
        shear_modulus=between(77e9, 82e9),
        side_gear_inertia=between(0.002, 0.008),
    )
