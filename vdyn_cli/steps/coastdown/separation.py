"""How well coasts between two speeds tell rolling resistance from air drag, before they are driven.

A coast is simulated with its sensitivities and weighed with the noise of the fitted runs; the inverse of the
information of n such runs gives the standard deviations and the correlation to be expected.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.gust_covariance import Surroundings, speed_noise
from vdyn_cli.physics.models.road_load import road_load
from vdyn_cli.quantities.constants import GRAVITY

PAIR = ("rolling_resistance", "drag_area")
STEP = 0.5  # s
LONGEST = 900.0  # s
SLIGHT = 1.0  # N, the least force reckoned with
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
    at: Mapping[str, float],
    sizes: Mapping[str, float],
    level: float,
    step: float,
    window: tuple[float, float],
    runs: int,
) -> Expected:
    """Both unknown, with the car at ``at`` (parameters of the road load) and noise of ``sizes``.

    Parameters
    ----------
    level : m/s of white noise in a sample of the speed; ``step`` : s between samples.
    window : upper and lower speed, m/s.
    """
    upper, lower = window
    model = road_load()
    simulator = Simulator(model, {n: at[n] for n in model.parameters}, unknowns=(*PAIR, "start.speed"))
    time = np.arange(0.0, _duration(at, upper, lower) + 2 * STEP, STEP)
    drive = Drive(
        time, {"grade": 0.0, "wind_speed": 0.0, "elapsed": time}, context={"heading": 0.0, "temperature": 293.15}
    )
    seen = simulator(drive, [at["rolling_resistance"], at["drag_area"], upper])
    speed = seen.outputs["speed"]
    bins = cut(time, max(2.0, time[-1] / 150))
    inertia = at["mass"] + at["rotating_mass"]
    pull = at["air_density"] * at["drag_area"] * bins.mean(speed) / inertia
    # A bin of the simulation holds fewer samples than the log's: their mean is as white, and as small.
    level = level * float(np.sqrt(min(step / STEP, 1.0)))
    noise = speed_noise(Surroundings(bins, pull, pull, at["mass"] / inertia, speed_level=level))
    factor = np.linalg.cholesky(noise.covariance({**sizes, "speed_noise": 1.0}))
    white = np.linalg.solve(factor, bins.mean(seen.sensitivities["speed"]))
    covariance = np.linalg.inv(white.T @ white)[:2, :2]
    # Each run has a start speed of its own, while the other two are common to all: runs add up.
    rolling, drag = np.sqrt(np.diag(covariance) / runs)
    return Expected(
        upper,
        lower,
        runs,
        float(rolling / at["rolling_resistance"]),
        float(drag / at["drag_area"]),
        float(covariance[0, 1] / np.sqrt(covariance[0, 0] * covariance[1, 1])),
    )


def _duration(at: Mapping[str, float], upper: float, lower: float) -> float:
    """s that a coast takes: integral of (M + mr) dV / F(V)."""
    speed = np.linspace(lower, upper, 200)
    weight = at["mass"] * GRAVITY
    force = (at["rolling_resistance"] + at["rolling_speed"] * speed) * weight
    force = force + 0.5 * at["air_density"] * at["drag_area"] * speed**2
    slowness = (at["mass"] + at["rotating_mass"]) / np.maximum(force, SLIGHT)
    return float(min(np.sum(0.5 * (slowness[1:] + slowness[:-1]) * np.diff(speed)), LONGEST))


def wider(
    at: Mapping[str, float],
    sizes: Mapping[str, float],
    level: float,
    step: float,
    window: tuple[float, float],
    runs: int,
) -> Expected | None:
    """The least widening of the window that tells both apart to 3 %, or the best there is."""
    tops = [window[0], *(v for v in UPPER if v > window[0])]
    bottoms = [window[1], *(v for v in LOWER if v < window[1])]
    windows = [(u, b) for u in tops for b in bottoms if (u, b) != window]
    tried = [expected(at, sizes, level, step, w, runs) for w in windows]
    good = [e for e in tried if max(e.rolling, e.drag) <= TOLD_APART]
    if good:
        return min(good, key=lambda e: e.upper - e.lower)
    return min(tried, key=lambda e: max(e.rolling, e.drag), default=None)
