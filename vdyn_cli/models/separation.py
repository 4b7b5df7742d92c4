"""How well coasts between two speeds tell rolling resistance from air drag, before they are driven.

A coast is simulated with its sensitivities and weighed with the noise of the fitted runs; the inverse of the
information of n such runs gives the standard deviations and the correlation to be expected.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.models.bins import cut
from vdyn_cli.models.gust_noise import Surroundings, speed_noise
from vdyn_cli.models.road_load import road_load

PAIR = ("rolling_resistance", "drag_area")
STEP = 0.5  # s
LONGEST = 900.0  # s
LOWER = tuple(v / 3.6 for v in (20.0, 15.0, 10.0, 5.0))
UPPER = tuple(v / 3.6 for v in (80.0, 100.0, 120.0, 140.0))
TOLD_APART = 0.03  # relative standard deviation of both, at which they count as separated


@dataclass(frozen=True)
class Expected:
    """What ``runs`` coasts from ``upper`` to ``lower`` (m/s) would tell: relative standard deviations, correlation."""

    upper: float
    lower: float
    runs: int
    rolling: float
    drag: float
    correlation: float


def expected(
    at: Mapping[str, float], sizes: Mapping[str, float], level: float, upper: float, lower: float, runs: int
) -> Expected:
    """Both unknown, with the car at ``at`` (parameters of the road load) and noise of ``sizes``.

    Parameters
    ----------
    level : m/s of white noise in the mean speed of half a second.
    """
    model = road_load()
    simulator = Simulator(model, {n: at[n] for n in model.parameters}, unknowns=(*PAIR, "start.speed"))
    time = np.arange(0.0, LONGEST, STEP)
    drive = Drive(
        time, {"grade": 0.0, "wind_speed": 0.0, "elapsed": time}, context={"heading": 0.0, "temperature": 293.15}
    )
    seen = simulator(drive, [at["rolling_resistance"], at["drag_area"], upper])
    speed = seen.outputs["speed"]
    stop = max(int(np.argmax(speed <= lower)) if speed[-1] <= lower else speed.size, 10)
    bins = cut(time[:stop], max(2.0, time[stop - 1] / 150))
    inertia = at["mass"] + at["rotating_mass"]
    pull = at["air_density"] * at["drag_area"] * bins.mean(speed[:stop]) / inertia
    noise = speed_noise(Surroundings(bins, pull, pull, at["mass"] / inertia, speed_level=level))
    white = np.linalg.solve(np.linalg.cholesky(noise.covariance(sizes)), bins.mean(seen.sensitivities["speed"][:stop]))
    covariance = np.linalg.inv(white.T @ white)[:2, :2]
    # The run's own start speed is met anew in each run, the two others are shared by all.
    rolling, drag = np.sqrt(np.diag(covariance) / runs)
    return Expected(
        upper,
        lower,
        runs,
        float(rolling / at["rolling_resistance"]),
        float(drag / at["drag_area"]),
        float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])),
    )


def wider(
    at: Mapping[str, float], sizes: Mapping[str, float], level: float, upper: float, lower: float, runs: int
) -> Expected | None:
    """The least widening of the speed window that tells both apart to 3 %, or the best there is."""
    tops = [upper, *(v for v in UPPER if v > upper)]
    bottoms = [lower, *(v for v in LOWER if v < lower)]
    tried = [expected(at, sizes, level, u, b, runs) for u in tops for b in bottoms if (u, b) != (upper, lower)]
    good = [e for e in tried if max(e.rolling, e.drag) <= TOLD_APART]
    if good:
        return min(good, key=lambda e: e.upper - e.lower)
    return min(tried, key=lambda e: max(e.rolling, e.drag), default=None)
