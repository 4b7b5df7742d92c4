"""Whether the fitted road load agrees with the decelerations that the logs show, without its noise model.

In classes of speed, the force of each run is inertia times the slope of a straight line through its measured speed,
less the known slope of the road. The mean of both directions is compared with the fitted road load at the same speeds.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from scipy.special import ndtri

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY, NORMAL95
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

CLASSES = 8  # of speed: a straight line over an eighth of a coast bends by less than the force's own scatter
LEAST_SHARED = 0.5  # share of the shorter of two traces: less of the road shows no common slope
FEWEST_SAMPLES = 5  # of a run in a class: a slope from fewer samples is mostly noise


@dataclass(frozen=True)
class LocalForces:
    """Forces in classes of speed, from the decelerations of the measured and of the simulated runs.

    Parameters
    ----------
    speed : (k,) m/s. measured, fitted : (k,) N. half : (k,) N, half the 95 % interval of their difference.
    """

    speed: Array
    measured: Array
    fitted: Array
    half: Array

    def disagreeing(self, speed: float) -> tuple[float, float] | None:
        """Measured minus fitted force at a speed and half its interval, N; None where they agree.

        Parameters
        ----------
        speed : m/s; both forces are interpolated between the classes and constant beyond the outermost ones.
        """
        off = float(np.interp(speed, self.speed, self.measured - self.fitted))
        half = float(np.interp(speed, self.speed, self.half))
        return (off, half) if abs(off) > self._bonferroni * half else None

    @property
    def excess(self) -> Array:
        """Ratio (k,) of difference to half interval, divided by the Bonferroni factor: above 1 the forces disagree."""
        return np.abs(self.measured - self.fitted) / np.maximum(self.half, 1e-300) / self._bonferroni

    @property
    def _bonferroni(self) -> float:
        """Factor by which each interval widens so that those of k classes jointly keep the significance level.

        z(1 - level/(2 k)) / z(0.975) with the normal quantile z
        """
        return -float(ndtri(COASTDOWN_POLICY.disagreement_level / 2 / self.speed.size)) / NORMAL95


def local_forces(fit: RoadLoadFit) -> LocalForces | None:
    """Measured and fitted forces in classes of speed; None where the car is driven or no class has enough runs.

    Means over the runs of each direction (at least two), then over directions; the interval is 95 % (Welch). Assumes
    that a run's deceleration within a class belongs to its mean speed, for measured and simulated run alike. The
    intervals include the slope of the road, which all runs of a direction share, with its fitted roughness.
    """
    if not fit.campaign.coasting or not fit.campaign.speed_fitted:
        return None
    low, high = fit.speeds
    edges = np.linspace(low, high, CLASSES + 1)
    headings = fit.campaign.headings
    simulated = [fit.simulate(k, level=True).outputs["speed"] for k in range(headings.size)]
    rows = []
    for a, b in pairwise(edges):
        seen = np.array([_forces(fit, k, simulated[k], float(a), float(b)) for k in range(headings.size)])
        good = np.isfinite(seen).all(axis=1)  # the log may miss a class that the simulation passes
        means, variance, fewest = [], 0.0, np.inf
        for way in np.unique(headings[good]):
            mine = seen[good & (headings == way)]
            if len(mine) < 2:
                continue
            means.append(mine.mean(axis=0))
            variance += float(np.var(mine[:, 1] - mine[:, 2], ddof=1)) / len(mine)
            fewest = min(fewest, len(mine))
        if means and len(means) == len(np.unique(headings)):
            speed, force, model = np.mean(means, axis=0)
            # Welch: the degrees of freedom of the summed variances are at least those of the smaller group.
            scatter = t_quantile(len(means) * (fewest - 1.0)) * np.sqrt(variance) / len(means)
            road = NORMAL95 * _road_force(fit, float(a), float(b))
            rows.append((speed, force, model, float(np.hypot(scatter, road))))
    return LocalForces(*np.array(rows).T) if rows else None


def _forces(fit: RoadLoadFit, run: int, simulated: Array, low: float, high: float) -> tuple[float, float, float]:
    """Mean speed (m/s) of a run between two speeds, and the forces (N) from its measured and simulated speed."""
    one = fit.campaign.runs[run]

    def slope(speed: Array) -> tuple[float, float]:
        falling = np.minimum.accumulate(speed)
        inside = (falling >= low) & (falling <= high)
        if inside.sum() < FEWEST_SAMPLES:
            return np.nan, np.nan
        time = one.time[inside] - one.time[inside].mean()
        grade = one.inputs["grade"]
        known = float(np.mean(grade[inside])) if isinstance(grade, np.ndarray) else float(grade)
        rate = float(time @ speed[inside]) / float(time @ time)
        return float(speed[inside].mean()), -fit.inertia * rate - fit.at["mass"] * GRAVITY * known

    speed, measured = slope(one.speed)
    return speed, measured, slope(simulated)[1]


def _road_force(fit: RoadLoadFit, low: float, high: float) -> float:
    """Standard deviation of the road's slope force between two speeds, N, averaged over the directions."""
    layout = fit.campaign.layout
    if layout is None or not fit.rows.road:
        return 0.0
    each: dict[float, list[Array]] = {}
    for k, run in enumerate(fit.campaign.runs):
        inside = (run.speed >= low) & (run.speed <= high)
        if inside.any():
            each.setdefault(run.heading, []).append(layout.weights(k)[inside].mean(axis=0))
    way = np.mean([np.mean(rows, axis=0) for rows in each.values()], axis=0)
    return fit.at["mass"] * GRAVITY * fit.sizes[ROUGHNESS] * float(np.linalg.norm(way @ layout.factor))


def influence(fit: RoadLoadFit) -> dict[str, dict[str, float]]:
    """Shift of each published unknown, SI, when a run is left out, to first order, by run; empty for a single run.

    The sum of the deletions of the run's units (inference.intervals.Spread).
    """
    solution = fit.solution
    shared = [(i, n) for i, n in enumerate(solution.names) if n in MAIN]
    found: dict[str, dict[str, float]] = {}
    if len(fit.campaign.runs) < 2:
        return found
    for k in sorted({u.run for u in solution.units}):  # the parts of a run are one unit, of the first of them
        change = sum((u.change for u in solution.units if u.run == k), np.zeros(len(solution.names)))
        found[fit.campaign.runs[k].name] = {n: float(change[i]) for i, n in shared}
    return found


def shared_force(fit: RoadLoadFit) -> Mapping[float, tuple[float, float]]:
    """Mean correlation of the residual force between runs of a direction, and the force that they share (N rms).

    By heading (+1, -1, 0), for directions with at least two runs. The residual force is the inertia times the rate of
    change of the binned speed residuals on a level road, as a function of the distance driven.
    """
    if not fit.campaign.speed_fitted:
        return {}
    traces: dict[float, list[tuple[Array, Array]]] = {}
    for k, run in enumerate(fit.campaign.runs):
        bins = fit.campaign.bins[k]
        left = bins.mean(run.speed - fit.simulate(k, level=True).outputs["speed"])
        place = bins.mean(run.along)
        force = -fit.inertia * np.diff(left) / np.diff(bins.time)
        traces.setdefault(run.heading, []).append((0.5 * (place[1:] + place[:-1]), force))
    found = {way: _common(each) for way, each in traces.items()}
    return {way: one for way, one in found.items() if one is not None}


def _common(traces: Sequence[tuple[Array, Array]]) -> tuple[float, float] | None:
    """Mean correlation between traces over the distance that two share, and the rms of their common part.

    Pairs of parts of runs that share little of the road are left out; None without any other pair.
    """
    correlations, products = [], []
    for (a, f), (b, g) in combinations(traces, 2):
        low, high = max(a[0], b[0]), min(a[-1], b[-1])
        if high - low < LEAST_SHARED * min(a[-1] - a[0], b[-1] - b[0]):
            continue
        grid = np.linspace(low, high, 40)
        one, other = np.interp(grid, a, f), np.interp(grid, b, g)
        covariance = np.cov(one, other, bias=True)
        products.append(covariance[0, 1])
        correlations.append(covariance[0, 1] / max(float(np.sqrt(covariance[0, 0] * covariance[1, 1])), 1e-300))
    if not products:
        return None
    return float(np.mean(correlations)), float(np.sqrt(max(float(np.mean(products)), 0.0)))
