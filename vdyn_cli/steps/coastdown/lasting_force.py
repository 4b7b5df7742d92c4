"""The part of the road load that comes from causes which stay with the car."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import Effect
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.models.road_load import road_load

Array = NDArray[np.float64]

INSTANT = 0.1  # s of simulation, from which a force is read
WARM = 7200.0  # s of driving, after which nothing warms up any more
SPEEDS = 12  # at which it is read


def resists(effect: Effect) -> bool:
    """Does the cause stay with the car and add a force of its own? A mass or a radius that is wrong adds none."""
    return effect.lasts and "parameters" not in effect.on


def lasting_force(
    effect: Effect, at: Mapping[str, float], speeds: tuple[float, float], temperature: float
) -> dict[str, Array]:
    """What a cause adds to F = f0 + f1 V + f2 V^2, (3,) per unit of each of its unknowns, in still air on the level.

    The deceleration of a coasting car with the cause in, less that without it, times the inertia, over the speeds.

    Parameters
    ----------
    at : parameters of the road load in SI, and the sizes of the cause's unknowns.
    speeds : slowest and fastest, m/s. temperature : K.

    Notes
    -----
    Assumes that the force is proportional to the size, as those of the catalogue are.
    """
    model = road_load()
    values = {n: at.get(n, 0.0) for n in model.parameters} | {"wind_variance": 0.0}
    inertia = values["mass"] + values["rotating_mass"]
    every = np.linspace(max(speeds[0], 1.0), speeds[1], SPEEDS)
    powers = np.vander(every, 3, increasing=True)
    rested = {**dict.fromkeys(model.inputs, 0.0), "elapsed": WARM}

    def rates(size: Mapping[str, float]) -> Array:
        car = Simulator(model, {**values, **size}, effects=(effect,))
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
