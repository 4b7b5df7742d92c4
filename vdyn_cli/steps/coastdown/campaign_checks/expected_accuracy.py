"""How well coasts between two speeds will separate rolling resistance from air drag, before they are driven.

A coast is simulated with its sensitivities and whitened with the noise of the fitted runs; the inverse of the
information of n such runs gives the expected standard deviations and correlation (Cramer-Rao).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.gust_covariance import Surroundings, speed_noise
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN

SIMULATION_STEP = 0.5  # s of a simulated coast: a quarter of a bin
LONGEST_COAST = 900.0  # s, of a simulated coast
LEAST_FORCE = 1.0  # N: without a force the car would coast forever
LOWER = tuple(v / 3.6 for v in (20.0, 15.0, 10.0, 5.0))  # m/s, ends of wider windows
UPPER = tuple(v / 3.6 for v in (80.0, 100.0, 120.0, 140.0))  # m/s, starts of wider windows
SEPARATED = 0.03  # relative standard deviation up to which both count as separated: the WLTP's 3 % of a force


@dataclass(frozen=True)
class CoastSetup:
    """The car, the noise and the number of coasts.

    Parameters
    ----------
    at : parameters of the road load in SI. sizes : amplitudes of the noise, by source.
    level : m/s, white noise in a sample of the speed. step : s between samples. runs : number of coasts.
    """

    at: Mapping[str, float]
    sizes: Mapping[str, float]
    level: float
    step: float
    runs: int


@dataclass(frozen=True)
class ExpectedAccuracy:
    """Relative standard deviations and correlation expected from ``runs`` coasts from ``upper`` to ``lower`` m/s."""

    upper: float
    lower: float
    runs: int
    rolling: float
    drag: float
    correlation: float

    @property
    def worst(self) -> float:
        """The larger of both relative standard deviations."""
        return max(self.rolling, self.drag)


def coasting_clock(at: Mapping[str, float], upper: float, lower: float) -> tuple[Array, Array]:
    """Speed and time of a coast on a level road in still air, (200,) m/s and s.

    t = integral of (M + mr) dV / F(V) from V to ``upper``

    Parameters
    ----------
    at : parameters of the road load in SI. upper, lower : m/s.
    """
    speed = np.linspace(upper, lower, 200)
    force = np.maximum(road_load_of(at).force(speed), LEAST_FORCE)
    slowness = (at["mass"] + at["rotating_mass"]) / force
    return speed, cumulative_integral(speed, -slowness)


def expected_accuracy(setup: CoastSetup, window: tuple[float, float]) -> ExpectedAccuracy:
    """Expected accuracy where both rolling resistance and drag area are estimated.

    Covariance (J' C^-1 J)^-1 / runs of a simulated coast, J its sensitivities and C the noise of its speed; the start
    speed of each coast is an unknown.

    Parameters
    ----------
    window : upper and lower speed, m/s.
    """
    (upper, lower), at = window, setup.at
    model = road_load()
    simulator = Simulator(model, {n: at[n] for n in model.parameters}, unknowns=(*MAIN, "start.speed"))
    duration = min(float(coasting_clock(at, upper, lower)[1][-1]), LONGEST_COAST)
    time = np.arange(0.0, duration + 2 * SIMULATION_STEP, SIMULATION_STEP)
    inputs: dict[str, Array | float] = {"grade": 0.0, "wind_speed": 0.0, "elapsed": time}
    drive = Drive(time, inputs, context={"heading": 0.0, "temperature": 293.15})
    seen = simulator(drive, [at["rolling_resistance"], at["drag_area"], upper])
    bins = cut(time, max(2.0, time[-1] / 150))
    inertia = at["mass"] + at["rotating_mass"]
    drag_slope = at["air_density"] * at["drag_area"] * bins.mean(seen.outputs["speed"]) / inertia
    # The simulation has fewer samples a bin than the log; the noise of the bin's mean stays the same.
    level = setup.level * float(np.sqrt(min(setup.step / SIMULATION_STEP, 1.0)))
    filtered = "speed_drift" in setup.sizes
    conditions = Surroundings(bins, drag_slope, drag_slope, at["mass"] / inertia, speed_level=level, filtered=filtered)
    noise = speed_noise(conditions)
    factor = np.linalg.cholesky(noise.covariance({**setup.sizes, "speed_noise": 1.0}))
    white = np.linalg.solve(factor, bins.mean(seen.sensitivities["speed"]))
    covariance = np.linalg.inv(white.T @ white)[:2, :2]
    # The two parameters are common to all runs and the start speed is not: information adds up over the runs.
    rolling, drag = np.sqrt(np.diag(covariance) / setup.runs)
    return ExpectedAccuracy(
        upper,
        lower,
        setup.runs,
        float(rolling / at["rolling_resistance"]),
        float(drag / at["drag_area"]),
        float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])),
    )


def wider_window(setup: CoastSetup, window: tuple[float, float]) -> ExpectedAccuracy | None:
    """The smallest wider window that separates both parameters, else the most accurate one; None if none is wider.

    Separated: both relative standard deviations are at most ``SEPARATED``.

    Parameters
    ----------
    window : upper and lower speed driven, m/s.
    """
    tops = [window[0], *(v for v in UPPER if v > window[0])]
    bottoms = [window[1], *(v for v in LOWER if v < window[1])]
    tried = [expected_accuracy(setup, (u, b)) for u in tops for b in bottoms if (u, b) != window]
    good = [e for e in tried if e.worst <= SEPARATED]
    if good:
        return min(good, key=lambda e: e.upper - e.lower)
    return min(tried, key=lambda e: e.worst, default=None)
