"""The part of the road load that comes from accepted effects which belong to the car."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import Effect
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.models.road_load import road_load

Array = NDArray[np.float64]

INSTANT = 0.1  # s of simulation, from whose change of speed a force is computed
WARM = 7200.0  # s of driving: twelve nominal time constants of the tire warm-up
SPEEDS = 12  # at which it is computed, for the three coefficients of F


def resists(effect: Effect) -> bool:
    """Whether an effect belongs to the car and adds a force: one that corrects a parameter (mass, radius) adds none."""
    return effect.lasts and "parameters" not in effect.on


def lasting_force(
    effect: Effect, at: Mapping[str, float], speeds: tuple[float, float], temperature: float
) -> dict[str, Array]:
    """What an effect adds to F = f0 + f1 V + f2 V^2, (3,) per unit of each unknown, on a level road in still air.

    The deceleration of a coasting car with the effect, less that without it, times the inertia, over the speeds.

    Assumes a force proportional to the amplitude, as those of the catalogue are.

    Parameters
    ----------
    at : parameters of the road load in SI, and the values of the effect's unknowns.
    speeds : lowest and highest, m/s. temperature : K.
    """
    model = road_load()
    values = {n: at.get(n, 0.0) for n in model.parameters} | {"wind_variance": 0.0}
    inertia = values["mass"] + values["rotating_mass"]
    every = np.linspace(max(speeds[0], 1.0), speeds[1], SPEEDS)
    powers = np.vander(every, 3, increasing=True)
    rested = {**dict.fromkeys(model.inputs, 0.0), "elapsed": WARM}

    def rates(amplitude: Mapping[str, float]) -> Array:
        car = Simulator(model, {**values, **amplitude}, effects=(effect,))
        drives = (
            Drive(np.array([0.0, INSTANT]), rested, {"speed": v}, {}, {"heading": 0.0, "temperature": temperature})
            for v in every.tolist()
        )
        ends = np.array([car(d, [], sensitivities=False).outputs["speed"][-1] for d in drives])
        return np.asarray((ends - every) / INSTANT)

    found: dict[str, Array] = {}
    for name in (n for n in effect.unknowns if n not in effect.nominal and at.get(n)):
        force = inertia * (rates({}) - rates({name: at[name]}))
        found[name] = np.asarray(np.linalg.lstsq(powers, force, rcond=None)[0] / at[name])
    return found
