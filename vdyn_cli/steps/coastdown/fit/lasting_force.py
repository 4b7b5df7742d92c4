"""The part of the road load that comes from accepted effects which belong to the car."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.arrays import Array

INSTANT = 0.1  # s of simulation whose change of speed gives the force
WARM = 7200.0  # s of driving: twelve nominal time constants of the tire warm-up
SPEEDS = 25  # at which the force is computed: a learned table has up to 20 knots over them


def adds_resistance(effect: Effect) -> bool:
    """Whether an effect belongs to the car and adds a force; one that corrects a parameter (mass, radius) does not."""
    return effect.lasts and "parameters" not in effect.on


@dataclass(frozen=True)
class LastingForce:
    """Force of accepted effects, added to F = f0 + f1 V + f2 V^2 of a car on a level road in still air.

    Parameters
    ----------
    coefficients : by unknown, (3,) per unit of it, N, N s/m and N s^2/m^2.
    beyond : speeds (n,) in m/s, and the force (n,) in N that three coefficients do not describe.
    slopes : by unknown, including shape parameters, (n,): change of the force at these speeds per unit of it.
    """

    coefficients: Mapping[str, Array]
    beyond: tuple[Array, Array]
    slopes: Mapping[str, Array]


def lasting_force(
    effects: Sequence[Effect],
    at: Mapping[str, float],
    std: Mapping[str, float],
    speeds: tuple[float, float],
    temperature: float,
) -> LastingForce:
    """The inertia times the difference of a coasting car's deceleration with and without each effect, over the speeds.

    Assumes that the force is proportional to the effect's amplitude.

    Parameters
    ----------
    effects : those that add a force (``adds_resistance``).
    at : parameters of the road load in SI, and the values of the effects' unknowns.
    std : of the estimated ones; slopes are difference quotients over +- std, because learned laws may be steep.
    speeds : lowest and highest, m/s. temperature : K.
    """
    every = np.linspace(max(speeds[0], 1.0), speeds[1], SPEEDS)
    powers = np.vander(every, 3, increasing=True)
    coefficients: dict[str, Array] = {}
    slopes: dict[str, Array] = {}
    beyond = np.zeros(SPEEDS)
    for effect in effects:
        for name, force in _forces(effect, at, every, temperature).items():
            fitted = np.linalg.lstsq(powers, force, rcond=None)[0]
            coefficients[name] = np.asarray(fitted / at[name])
            slopes[name] = np.asarray(force / at[name])
            beyond += force - powers @ fitted
        for name in (n for n in effect.nominal if std.get(n, 0.0) > 0.0):
            ends = [at[name] + way * std[name] for way in (-1.0, 1.0)]
            low, high = (sum(_forces(effect, {**at, name: end}, every, temperature).values()) for end in ends)
            slopes[name] = np.asarray((high - low) / (ends[1] - ends[0]))
    return LastingForce(coefficients, (every, beyond), slopes)


def _forces(effect: Effect, at: Mapping[str, float], every: Array, temperature: float) -> dict[str, Array]:
    """Force of each amplitude of an effect, (n,) N at the speeds ``every``."""
    model = road_load()
    values = {n: at.get(n, 0.0) for n in model.parameters} | {"wind_variance": 0.0}
    values |= {n: at.get(n, nominal) for n, nominal in effect.nominal.items()}
    inertia = values["mass"] + values["rotating_mass"]
    inputs = {**dict.fromkeys(model.inputs, 0.0), "elapsed": WARM}

    def rates(amplitude: Mapping[str, float]) -> Array:
        car = Simulator(model, {**values, **amplitude}, effects=(effect,))
        drives = (
            Drive(np.array([0.0, INSTANT]), inputs, {"speed": v}, {}, {"heading": 0.0, "temperature": temperature})
            for v in every.tolist()
        )
        ends = np.array([car(d, [], sensitivities=False).outputs["speed"][-1] for d in drives])
        return np.asarray((ends - every) / INSTANT)

    names = [n for n in effect.unknowns if n not in effect.nominal and at.get(n)]
    return {n: inertia * (rates({}) - rates({n: at[n]})) for n in names}
