"""What an uneven road adds to the motion of a body on its springs, and to its axle loads.

The roughness is a random walk of the height over the road, of slope density ``SLOPE`` (ISO 8608 class A: G(0.1/m) up to
32e-6 m^3, slope density (2 pi 0.1/m)^2 G), averaged over the length of a tire's contact; the rear axle meets it a
wheelbase later. The springs are linear, so that it is added to what the driver causes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.plant.sensors import Array
from tests.plant.vehicle import Vehicle

SLOPE = 2e-6  # m, one-sided density of the slope over the wavenumber: G(0.1/m) = 5e-6 m^3
CELL, CONTACT = 0.02, 0.16  # m
STEP = 0.001  # s


@dataclass(frozen=True)
class RoadMotion:
    """Signals at the sample times, (n,) each."""

    front: Array
    rear: Array
    pitch_rate: Array
    pitch_acceleration: Array


def road_motion(vehicle: Vehicle, times: Array, speed: Array, rng: np.random.Generator) -> RoadMotion:
    """The motion by the road alone, by semi-implicit Euler steps of 1 ms.

    Parameters
    ----------
    times, speed : (n,), s and m/s.
    """
    clock = np.arange(times[0], times[-1] + STEP, STEP)
    along = np.cumsum(np.interp(clock, times, speed)) * STEP
    walk = np.cumsum(rng.normal(0.0, np.sqrt(SLOPE * CELL / 2.0), int((along[-1] + 10.0) / CELL)))
    height = np.convolve(walk, np.ones(round(CONTACT / CELL)) * CELL / CONTACT, "valid")
    places = CELL * np.arange(height.size)
    axles = [np.interp(along + vehicle.wheelbase - back, places, height) for back in (0.0, vehicle.wheelbase)]
    arms = np.array([vehicle.cg_to_front, -vehicle.cg_to_rear])
    stiffness = np.array([vehicle.suspension_stiffness_front, vehicle.suspension_stiffness_rear])
    damping = np.array([vehicle.suspension_damping_front, vehicle.suspension_damping_rear])
    road = np.column_stack(axles) - axles[0][0]
    rise = np.gradient(road, STEP, axis=0)
    place, rate, found = np.zeros(2), np.zeros(2), np.empty((clock.size, 4))
    for k in range(clock.size):
        force = stiffness * (road[k] - place[0] - arms * place[1]) + damping * (rise[k] - rate[0] - arms * rate[1])
        push = np.array([force.sum() / vehicle.mass, force @ arms / vehicle.pitch_inertia])
        found[k] = (*force, rate[1] + 0.5 * STEP * push[1], push[1])
        rate = rate + STEP * push
        place = place + STEP * rate
    return RoadMotion(*(np.interp(times, clock, column) for column in found.T))
