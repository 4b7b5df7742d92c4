"""Road load as a polynomial of speed: units of dynamometers, and the correction to reference conditions.

F = f0 + f1 V + f2 V^2, in SI here, in N and km/h as F0, F1, F2, in lbf and mph as A, B, C.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.lasting_force import LastingForce

POUND_FORCE = 4.4482216152605  # N, exact (international pound, standard gravity)
MILE_PER_HOUR = 0.44704  # m/s, exact
KILOMETER_PER_HOUR = 3.6  # per m/s
ROLLING_BY_TEMPERATURE = 8.6e-3  # 1/K, K0 of the coast-down standards

DYNO_KEYS = ("F0_N", "F1_N_per_kmh", "F2_N_per_kmh2")
EPA_KEYS = ("A_lbf", "B_lbf_per_mph", "C_lbf_per_mph2")

NO_COVARIANCE: Array = np.zeros((0, 0))  # of no estimated parameters


@dataclass(frozen=True)
class RoadLoad:
    """f0 N, f1 N s/m, f2 N s^2/m^2, with their covariance (3, 3) and its degrees of freedom.

    ``beyond`` is the force that three coefficients do not describe: speeds m/s and forces N, each (n,);
    ``spread`` is then the standard deviation of the whole force, over the same speeds.
    ``excess`` (3,) are the coefficients of a force that may be contained, though it is not the car's: intervals are
    longer on the side where the load without it lies.
    """

    f0: float
    f1: float
    f2: float
    covariance: Array = field(default_factory=lambda: np.zeros((3, 3)))
    degrees: float = float("inf")
    beyond: tuple[Array, Array] | None = None
    spread: tuple[Array, Array] | None = None
    excess: Array = field(default_factory=lambda: np.zeros(3))

    @property
    def coefficients(self) -> Array:
        """f0, f1, f2 as (3,), SI."""
        return np.array([self.f0, self.f1, self.f2])

    def force(self, speed: float | Array) -> float | Array:
        """Force in N at a speed, or at speeds (n,), in m/s."""
        other: float | Array = 0.0 if self.beyond is None else np.interp(speed, *self.beyond)
        return self.f0 + self.f1 * speed + self.f2 * speed**2 + other

    def interval(self, speed: float | Array) -> tuple[Array, Array]:
        """95 % interval of the force, N, at speeds (n,) in m/s."""
        v = np.atleast_1d(np.asarray(speed, dtype=float))
        return one_sided(np.asarray(self.force(v)), self.half_width(v), np.vander(v, 3, increasing=True) @ self.excess)

    def half_width(self, speed: float | Array) -> Array:
        """Half the 95 % interval of the force without ``excess``, N, at speeds (n,) in m/s."""
        v = np.atleast_1d(np.asarray(speed, dtype=float))
        gradient = np.vander(v, 3, increasing=True)
        std = np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", gradient, self.covariance, gradient), 0.0))
        if self.spread is not None:
            every, whole = self.spread
            inside = (v >= every[0]) & (v <= every[-1])
            std = np.where(inside, np.interp(v, every, whole), np.maximum(std, np.interp(v, every, whole)))
        return np.asarray(t_quantile(min(self.degrees, 1e6)) * std)

    def force_with_interval(self, speed: float) -> tuple[float, tuple[float, float]]:
        """Force and its 95 % interval, N, at one speed in m/s."""
        low, high = self.interval(speed)
        return float(self.force(speed)), (float(low[0]), float(high[0]))

    def intervals(self) -> tuple[Array, Array]:
        """Lower and upper ends (3,) of the 95 % intervals of f0, f1, f2, SI."""
        half = np.asarray(t_quantile(min(self.degrees, 1e6)) * np.sqrt(np.diag(self.covariance)))
        return one_sided(self.coefficients, half, self.excess)

    def published(self) -> dict[str, tuple[float, tuple[float, float]]]:
        """F0 F1 F2 in N and km/h, then A B C in lbf and mph, each with its 95 % interval, by its key in the JSON."""
        k, rows, found = np.arange(3.0), np.array([self.coefficients, *self.intervals()]), {}
        for keys, times, per in (
            (DYNO_KEYS, 1.0, KILOMETER_PER_HOUR**k),
            (EPA_KEYS, MILE_PER_HOUR**k, POUND_FORCE),
        ):
            for key, (value, low, high) in zip(keys, (rows * times / per).T.tolist(), strict=True):
                found[key] = value, (low, high)
        return found

    def document(self) -> dict[str, float | list[float]]:
        """F0 F1 F2 and A B C, each with its 95 % interval, for the JSON."""
        found: dict[str, float | list[float]] = {}
        for key, (value, interval) in self.published().items():
            found |= {key: value, f"{key}_interval95": list(interval)}
        return found


def one_sided(value: Array, half: Array, excess: Array) -> tuple[Array, Array]:
    """Ends (n,) of intervals of values, each longer on the side to which the value without an excess lies.

    low = value - sqrt(half^2 + max(excess, 0)^2),   high = value + sqrt(half^2 + min(excess, 0)^2)
    """
    return value - np.hypot(half, np.maximum(excess, 0.0)), value + np.hypot(half, np.minimum(excess, 0.0))


@dataclass(frozen=True)
class Conditions:
    """Air and vehicle: ``temperature`` K, ``air_density`` kg/m^3, ``mass`` kg as tested."""

    temperature: float
    air_density: float
    mass: float


def corrected_load(load: RoadLoad, test: Conditions, reference: Conditions) -> RoadLoad:
    """The road load under reference conditions.

    F* = (f0 TM/m + f1 V)(1 + K0 (T - T0)) + (rho0/rho) f2 V^2,  K0 = 8.6e-3 1/K

    with temperature T (K), density rho (kg/m^3) and mass m (kg) of the test, and T0, rho0 and TM of the reference.

    Notes
    -----
    The wind correction of the standards (w1 = f2 w^2) is not needed, because the fit includes gusts and mean winds.
    Assumes that f0 and f1 belong to tires and driveline, and f2 to the air. After UN GTR 15 (WLTP), annex 4, and
    SAE J2263, with their temperature factor; both use T0 = 20 degC, with 100 kPa and 98.21 kPa respectively.
    """
    warm = 1.0 + ROLLING_BY_TEMPERATURE * (test.temperature - reference.temperature)
    scale = np.array([warm * reference.mass / test.mass, warm, reference.air_density / test.air_density])
    f0, f1, f2 = (scale * load.coefficients).tolist()
    covariance = load.covariance * np.outer(scale, scale)
    return replace(load, f0=f0, f1=f1, f2=f2, covariance=covariance, excess=scale * load.excess)


def road_load_of(
    at: Mapping[str, float],
    names: tuple[str, ...] = (),
    covariance: Array = NO_COVARIANCE,
    degrees: float = float("inf"),
    lasting: LastingForce | None = None,
) -> RoadLoad:
    """The road load polynomial from the model's parameters, with its covariance to first order.

    f0 = frr M g,  f1 = frr1 M g,  f2 = 1/2 rho Cd A

    Parameters
    ----------
    at : rolling_resistance, rolling_speed, drag_area, mass, air_density in SI.
    names, covariance : of the estimated parameters, (k, k). degrees : of freedom of the covariance.
    lasting : force of the effects that belong to the car.
    """
    added: Mapping[str, Array] = lasting.coefficients if lasting else {}
    weight, density = at["mass"] * GRAVITY, 0.5 * at["air_density"]
    slopes = {
        "rolling_resistance": (weight, 0.0, 0.0),
        "rolling_speed": (0.0, weight, 0.0),
        "drag_area": (0.0, 0.0, density),
        "mass": (at["rolling_resistance"] * GRAVITY, at["rolling_speed"] * GRAVITY, 0.0),
        "air_density": (0.0, 0.0, 0.5 * at["drag_area"]),
        **{n: tuple(c.tolist()) for n, c in added.items()},
    }
    more = sum((at[n] * c for n, c in added.items()), np.zeros(3)).tolist()
    gradient = np.array([slopes.get(n, (0.0, 0.0, 0.0)) for n in names]).reshape(len(names), 3)
    return RoadLoad(
        at["rolling_resistance"] * weight + more[0],
        at["rolling_speed"] * weight + more[1],
        density * at["drag_area"] + more[2],
        gradient.T @ covariance @ gradient,
        degrees,
        lasting.beyond if lasting else None,
        _spread(names, gradient, covariance, lasting) if lasting and lasting.slopes else None,
    )


def _spread(names: tuple[str, ...], gradient: Array, covariance: Array, lasting: LastingForce) -> tuple[Array, Array]:
    """Speeds and the standard deviation of the whole force there, including the shapes of learned laws."""
    every = lasting.beyond[0]
    powers = np.vander(every, 3, increasing=True)
    slopes = np.column_stack([lasting.slopes.get(n, powers @ g) for n, g in zip(names, gradient, strict=True)])
    return every, np.sqrt(np.maximum(np.einsum("ni,ij,nj->n", slopes, covariance, slopes), 0.0))
