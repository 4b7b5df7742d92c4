"""A deceleration that sets in gradually after a held speed: a receiver that filters the speed, or a slow pedal.

A filter with the time constant T, or a drive that fades with it, changes the speed after the release at t = 0 to::

    V(t) = V0 + p t - a (t - T (1 - exp(-t/T))) + q t^2

with V0 + p t the held speed. The deceleration is complete after a few T; fitted before, the drag area is too small and
the road load seems to change its law at the highest speeds. T is common to all runs, the release is fitted in each.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

LAGS = 0.25 * np.sqrt(2.0) ** np.arange(8)  # s, grid of T
TESTED = 2  # index of T = 0.5 s: its gain is nearly the score for any T, and scatters least between runs
BEFORE = 4.0  # s before the release that are fitted: earlier, a filter still lags behind the acceleration to this speed
AFTER = 12.0  # s after it: four of the longest T, over which a parabola still describes the coast
EARLIER, LATER = 4.0, 1.0  # s about a release found without a lag in which that with a lag lies: it is about T earlier
RELEASE_STEP = 0.1  # s of a bin, and between the releases that are tried
FEWEST_ROWS = 12  # bins of a run, whose fit has six unknowns


@dataclass(frozen=True)
class GradualRelease:
    """The common time constant T, s, and the time of each run's release, s; None for a run without a held speed."""

    lag: float
    releases: tuple[float | None, ...]


def gradual_release(logs: Sequence[Log], releases: Sequence[float | None]) -> GradualRelease | None:
    """The gradual onset of the deceleration that all runs with a held speed show; None where they show none.

    With S(T) the residual squares of a run of n bins, least over its release, the runs' gains n ln(S(0) / S(T)) for
    T = 0.5 s must have a mean above zero by a one-sided Student t test (``clutch_chance``). T is the shortest one whose
    mean gain is within one standard error of the largest, since longer ones cut more.

    Parameters
    ----------
    logs : whole, with ``speed``, m/s. releases : s, of each run, found without a lag; None: no held speed.
    """
    held = [k for k, release in enumerate(releases) if release is not None]
    fits = {k: _fits(logs[k], float(releases[k] or 0.0)) for k in held}
    found = {k: fit for k, fit in fits.items() if fit is not None}
    if len(found) < COASTDOWN_POLICY.clutch_runs:
        return None
    gains = np.array([gain for gain, _ in found.values()])
    limit = t_quantile(len(gains) - 1, 1.0 - COASTDOWN_POLICY.clutch_chance)
    if gains[:, TESTED].mean() <= limit * _mean_error(gains[:, TESTED]):
        return None
    behind = gains[:, [int(np.argmax(gains.sum(axis=0)))]] - gains
    best = int(np.argmax(behind.mean(axis=0) <= _mean_error(behind)))
    at = {k: float(times[best]) for k, (_, times) in found.items()}
    return GradualRelease(float(LAGS[best]), tuple(at.get(k, releases[k]) for k in range(len(logs))))


def _mean_error(values: Array) -> Array:
    """Standard error of the mean over the first axis."""
    return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def _fits(log: Log, release: float) -> tuple[Array, Array] | None:
    """Gain n ln(S(0) / S(T)) and best release, s, of one run for each of ``LAGS``, (l,); None with too few rows."""
    there = np.isfinite(log["speed"]) & (log.time >= release - BEFORE) & (log.time <= release + AFTER)
    if there.sum() < FEWEST_ROWS or float(log.time[there][-1]) < release + 0.9 * AFTER:
        return None
    bins = cut(log.time[there], RELEASE_STEP)
    speed = bins.mean(log["speed"][there])
    tried = release + np.arange(-EARLIER, LATER, RELEASE_STEP)
    tried = tried[tried > bins.time[1]]
    if speed.size < FEWEST_ROWS or not tried.size:
        return None
    left = np.array([_squares(bins.time, speed, tried, lag) for lag in (0.0, *LAGS)])
    least = left.min(axis=1)
    return speed.size * np.log(least[0] / least[1:]), tried[np.argmin(left[1:], axis=1)]


def _squares(time: Array, speed: Array, releases: Array, lag: float) -> Array:
    """Sum of squared residuals, (r,) m^2/s^2, of the law at each release, (r,) s."""
    after = np.maximum(time - releases[:, None], 0.0)
    onset = after - lag * -np.expm1(-after / lag) if lag else after
    steady = np.broadcast_to(np.stack([np.ones_like(time), time - time[0]]), (releases.size, 2, time.size))
    design = np.concatenate([steady, onset[:, None], after[:, None] ** 2], axis=1).transpose(0, 2, 1)
    basis = np.linalg.qr(design)[0]
    return np.asarray(speed @ speed - np.sum((speed @ basis) ** 2, axis=-1))
