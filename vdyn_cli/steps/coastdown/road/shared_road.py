"""The road that all runs share: a random slope profile over position.

An undulating road exerts the same force on every run of one direction at the same place, and the opposite force on the
runs of the other direction. If it were modeled as gusts, which differ from run to run, averaging over the runs would
seem to remove it, and the intervals would be too narrow. So the slopes at equidistant knots are unknowns of the fit,
with a normal prior of standard deviation ``roughness`` (m/m) and the most likely of a few correlations over distance
(SPECTRA). The correlation determines the slope at the wavelengths that a coast cannot separate from a resistance by the
slope at the others. A slope i accelerates a car by -g i M/(M + mr).

The mean slope is a separate candidate effect (road_grade). With it the random road has a mean slope of zero
(``level``); without it, as in the baseline, the mean slope is part of the random road.

Places come from the logged position, else from the distance that each run has driven. In that case the runs of one
direction share one profile. The profile of the way back is the mirrored one of the way out where the runs show how far
the starts of both directions are apart (``turn``); else both are correlated as over all distances that are possible
(``turns``).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Unknown
from vdyn_cli.inference.bins import Bins
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.road_spectrum import correlation_at, slope_correlation

KNOTS = 96  # of all profiles: 20 to 40 m apart, which a coasting car passes in one bin of 2 s
VARIANCE_SHARE = 0.97  # of the slope's variance that its unknowns describe; the rest is short waves
MOST_UNKNOWNS = 60  # of the slope
TURN_STD = 0.2  # share of a run's length: standard deviation of where the runs of the other direction begin
DEFAULT_SPECTRUM = 1  # index in SPECTRA, where the runs show no road: crests and sags of 100 to 500 m
WHOLE_ROAD = "shared_road"  # name in ``covers`` of an effect that replaces the random road
MEAN_SLOPE = "road_slope"  # likewise, of an effect that replaces its mean slope
PLACES_BETWEEN = 8  # two sparse samples at which the slope is evaluated: 5 s are up to 150 m, 4 to 8 knots
DIAGONAL = 1e-9  # added to the unit diagonal of a correlation matrix, so that its Cholesky factor exists


@dataclass(frozen=True)
class RoadLayout:
    """Positions of the runs on the road.

    Parameters
    ----------
    knots : (m,) m, ascending within each profile. profile : (m,), label of the profile of each knot.
    along : for each run (n,) m, coordinate of its samples. owner : label of the profile of each run.
    sense : for each run, +1 where it climbs where the profile rises, else -1. spectrum : index in SPECTRA.
    level : the profiles have a mean slope of zero; two that overlap, a mean slope that is the same both ways.
    turns : of the two profiles, possible distances between their starts over the same road, m, with probabilities.
    """

    knots: Array
    profile: NDArray[np.int64]
    along: tuple[Array, ...]
    owner: tuple[int, ...]
    sense: tuple[float, ...]
    spectrum: int = 0
    level: bool = False
    turns: tuple[tuple[float, float], ...] = ()

    @cached_property
    def factor(self) -> Array:
        """Factor (m, k) of the correlation of the slopes at the knots, without directions of negligible variance.

        Profiles are independent of each other, except over the same road: with probability p of a distance T between
        their starts, the correlation of slopes at x and y is -sum p r(T - x - y) where that within a profile is r(x-y).
        """
        same = self.profile[:, None] == self.profile[None, :]
        correlation = np.where(same, slope_correlation(self.knots, self.spectrum), 0.0)
        sums = self.knots[:, None] + self.knots[None, :]
        for turn, probability in self.turns:
            correlation -= np.where(same, 0.0, probability * correlation_at(np.abs(turn - sums), self.spectrum))
        if self.level:
            alike = np.where(same, 1.0, -1.0 if self.turns else 0.0)
            about_mean = np.eye(self.knots.size) - alike / np.abs(alike).sum(axis=1)
            correlation = about_mean @ correlation @ about_mean
            correlation *= self.knots.size / np.trace(correlation)
        values, axes = np.linalg.eigh(correlation)
        order = np.argsort(-values)[:MOST_UNKNOWNS]
        kept = order[: 1 + int(np.searchsorted(np.cumsum(values[order]), VARIANCE_SHARE * values.sum()))]
        return np.asarray(axes[:, kept] * np.sqrt(values[kept]), dtype=np.float64)

    def coordinates(self, profile: Array) -> Array:
        """The road's unknowns times the roughness, (k,), that best approximate slopes at the knots, (m,)."""
        return np.asarray(np.linalg.lstsq(self.factor, profile, rcond=None)[0])

    def moved(self, run: int, shift: float) -> RoadLayout:
        """The layout with a run shifted by ``shift`` m in its driving direction."""
        along = list(self.along)
        ahead = 1.0 if along[run][-1] >= along[run][0] else -1.0
        along[run] = along[run] + ahead * shift
        return replace(self, along=tuple(along))

    def weights(self, run: int) -> Array:
        """Weights (n, m) of the knots' slopes in the uphill slope at each sample of a run."""
        return self._weights_at(run, self.along[run], np.arange(self.along[run].size))

    def mean_weights(self, run: int, bins: Bins) -> Array:
        """Mean (b, m) of ``weights`` over the samples of each bin."""
        row = np.repeat(np.arange(bins.count.size), bins.count)
        return self._weights_at(run, self.along[run], row) / bins.count[:, None]

    def weights_until_next(self, run: int) -> Array:
        """Weights (n, m) of the knots' slopes in the mean uphill slope from each sample to the next, if sparse."""
        along = self.along[run]
        share = (np.arange(PLACES_BETWEEN) + 0.5) / PLACES_BETWEEN
        ahead = along + np.diff(along, append=along[-1]) * share[:, None]
        return self._weights_at(run, ahead.ravel(), np.tile(np.arange(along.size), PLACES_BETWEEN)) / PLACES_BETWEEN

    def _weights_at(self, run: int, along: Array, row: NDArray[np.intp]) -> Array:
        """The weights at coordinates ``along`` (n,) m, summed in the rows ``row`` (n,) of the result."""
        mine, size = np.flatnonzero(self.profile == self.owner[run]), self.knots.size
        at = self.knots[mine]
        place = np.clip(along, at[0], at[-1])
        low = np.clip(np.searchsorted(at, place, side="right") - 1, 0, at.size - 2)
        share = (place - at[low]) / (at[low + 1] - at[low])
        where = size * np.r_[row, row] + mine[np.r_[low, low + 1]]
        found = np.bincount(where, self.sense[run] * np.r_[1.0 - share, share], size * (int(row.max()) + 1))
        return np.asarray(found.reshape(-1, size))


def road_unknowns(layout: RoadLayout) -> tuple[Unknown, ...]:
    """Unknowns of the road in units of the roughness: independent nuisance parameters with a prior of one."""
    degrees = independent_slopes(layout.factor)
    one = Unknown("", 0.0, prior=(0.0, 1.0), nuisance=True, prior_degrees=degrees, prior_stated=False)
    return tuple(replace(one, name=f"road_{k + 1}") for k in range(layout.factor.shape[1]))


def independent_slopes(factor: Array) -> float:
    """Effective number of independent slopes from which the roughness is estimated: (tr K)^2 / tr(K^2).

    Parameters
    ----------
    factor : (m, k), of their correlation K.
    """
    correlation = factor @ factor.T
    return float(np.trace(correlation) ** 2 / np.sum(correlation**2))


def slope_factor(knots: Array, spectrum: int) -> Array:
    """Lower triangular factor (m, m) of ``slope_correlation``."""
    correlation = slope_correlation(knots, spectrum)
    return np.asarray(np.linalg.cholesky(correlation + DIAGONAL * np.eye(knots.size)), dtype=np.float64)


def road_layout(runs: Sequence[RoadRun], turn: float | None, spectrum: int) -> RoadLayout:
    """The layout of runs on one road, or on a separate profile for each direction.

    Parameters
    ----------
    turn : m, used where position is not logged: distance from the start of the runs out to the start of the runs back
        over the same road; None: each direction has a separate profile.
    spectrum : index in SPECTRA.
    """
    ways = [r.heading for r in runs]
    if all(r.place is not None for r in runs):
        along = [(r.place or 0.0) + r.heading * r.distance for r in runs]
        owner, sense = [0] * len(runs), ways
    elif turn is not None:
        along = [r.along if r.heading > 0 else turn - r.along for r in runs]
        owner, sense = [0] * len(runs), ways
    else:
        along = [r.along for r in runs]
        owner = [sorted(set(ways)).index(w) for w in ways]
        sense = [1.0] * len(runs)
    profiles = max(owner) + 1
    knots, label = [], []
    for p in range(profiles):
        mine = np.concatenate([a[[0, -1]] for a, o in zip(along, owner, strict=True) if o == p])
        count = KNOTS // profiles + (KNOTS % profiles if p == 0 else 0)
        knots.append(np.linspace(mine.min(), max(mine.max(), mine.min() + 1.0), count))
        label.append(np.full(count, p, dtype=np.int64))
    return RoadLayout(
        np.concatenate(knots),
        np.concatenate(label),
        tuple(np.asarray(a, dtype=np.float64) for a in along),
        tuple(owner),
        tuple(float(s) for s in sense),
        spectrum,
    )


def possible_turns(runs: Sequence[RoadRun]) -> tuple[Array, Array]:
    """Distances between the starts of both directions, (k,) m, and the logarithms of their prior probabilities, (k,).

    A test road is driven to and fro: the way back begins where the way out ended, within TURN_STD of its length.
    """
    longest = max(float(r.along[-1]) for r in runs)
    share = np.linspace(0.6, 1.6, 51)
    chance = -0.5 * ((share - 1.0) / TURN_STD) ** 2
    return share * longest, chance - float(np.log(np.sum(np.exp(chance))))
