"""A deceleration that sets in gradually at the start of all coasts, and the removal of those seconds.

A receiver that filters its speed with a time constant T delays the onset of the deceleration a where a coast begins at
constant speed::

    V(t) = V0 - a (t - T) - a T exp(-t/T) + curvature t^2

After a few T the filter is a pure delay, which changes no force. Before, the deceleration reads too small: fitted
without a cut, the drag area is up to 1.5 half-widths too small for T = 0.5 s, and the road load seems to change its law
at the highest speeds. T and the amplitude of the exponential are estimated from the first seconds of each run. A filter
has the amplitude a T in every run, a clutch has the opposite sign, and a gust or a road has another shape.

After a held speed V0 + p t, the release at t = 0 is also fitted in each run; a drive that fades with T, as with a slow
pedal, has the same course::

    V(t) = V0 + p t - a (t - T (1 - exp(-t/T))) + q t^2
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, KeptAndRejected, rows
from vdyn_cli.steps.coastdown.coasts.start_cuts import from_start, without_starts
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

SETTLED = 4.0  # time constants that are cut: 2 % of the transient are left
FEWEST_ROWS = 12  # samples of a fitted start, which has four unknowns, six with its release
# Without a held speed
LAGS = tuple(float(t) for t in np.geomspace(0.2, 1.6, 13))  # s, grid of T: shorter ones change no estimate
LENGTH = 4.5  # s of a run's start that are fitted: a parabola still describes the coast, and gusts change it little
# After a held speed
RELEASE_LAGS = 0.25 * np.sqrt(2.0) ** np.arange(8)  # s, grid of T
TESTED = 2  # index of T = 0.5 s: its gain is nearly the score for any T, and scatters least between runs
BEFORE = 4.0  # s before the release that are fitted: earlier, a filter still lags behind the acceleration to this speed
AFTER = 12.0  # s after it: four of the longest T, over which a parabola still describes the coast
EARLIER, LATER = 4.0, 1.0  # s about a release found without a lag in which that with a lag lies: it is about T earlier
RELEASE_STEP = 0.1  # s of a bin, and between the releases that are tried


def without_filtered_start(segments: Sequence[CoastSegment]) -> KeptAndRejected:
    """Coasts without the first seconds in which a filtered speed lags or the deceleration sets in, and those parts."""
    held = [s.held[1] - COASTDOWN_POLICY.held_release if s.held else None for s in segments]
    gradual, releases = _gradual_release([s.whole for s in segments], held) or (None, [None] * len(segments))
    starts = [
        from_start(one) if release is None else rows(one.whole, one.whole.time >= release)
        for one, release in zip(segments, releases, strict=True)
    ]
    lag = gradual or filter_lag(starts)
    if lag is None:
        return list(segments), []
    if gradual:
        why = f"after the held speed the deceleration of all runs sets in with a time constant of {lag:.2g} s: "
        why += "the receiver filters the speed, or the pedal was released slowly"
    else:
        why = f"the speed of all runs lags by {lag:.2g} s at the start of the coast: the receiver probably filters it"
    return without_starts(segments, starts, SETTLED * lag, lag, why)


def filter_lag(logs: Sequence[Log]) -> float | None:
    """The time constant T, s, of the filter that all runs show at their start; None where they show none.

    V(t) = V0 - a (t - T) - q a T exp(-t/T) + curvature t^2

    T is the value of ``LAGS`` with the least mean squared residual; with it, q of each run follows by linear least
    squares. A filter is found if the mean of q over runs is above zero by a one-sided Student t test
    (``clutch_chance``) and within ``filter_share`` of 1.

    Parameters
    ----------
    logs : the coasts with ``speed``, m/s, each from its start.

    Notes
    -----
    Assumes a first-order filter with the same T in all runs, and a constant speed before the start. The exponential is
    the ramp response of a first-order low-pass.
    """
    if len(logs) < COASTDOWN_POLICY.clutch_runs:
        return None
    tried = []
    for lag in LAGS:
        fits = [fit for log in logs if (fit := _exponential(log, lag)) is not None]
        if len(fits) == len(logs):
            shares, misfits = np.array(fits).T
            tried.append((float(misfits.mean()), lag, shares))
    if not tried:
        return None
    _, lag, shares = min(tried, key=lambda t: t[0])
    close = abs(float(shares.mean()) - 1.0) < COASTDOWN_POLICY.filter_share
    return lag if close and _above_zero(shares) else None


def _above_zero(values: Array) -> bool:
    """Whether the mean over runs is above zero by a one-sided Student t test (``clutch_chance``)."""
    limit = t_quantile(len(values) - 1, 1.0 - COASTDOWN_POLICY.clutch_chance)
    return bool(values.mean() > limit * _mean_error(values))


def _mean_error(values: Array) -> Array:
    """Standard error of the mean over the first axis."""
    return np.asarray(values.std(axis=0, ddof=1) / np.sqrt(len(values)))


def _exponential(log: Log, lag: float) -> tuple[float, float] | None:
    """Amplitude of the exponential as a share of a T, and the mean squared residual; None with too few rows."""
    time = log.time - log.time[0]
    inside = time <= LENGTH
    if int(inside.sum()) < FEWEST_ROWS or float(np.diff(time[inside]).max()) > lag:
        return None
    t, speed = time[inside], log["speed"][inside]
    design = np.column_stack([np.ones_like(t), t, t**2, np.exp(-t / lag)])
    found = np.linalg.lstsq(design, speed, rcond=None)[0]
    slowing = -float(found[1])
    if slowing <= 0.0:
        return None
    return -float(found[3]) / (slowing * lag), float(np.mean((speed - design @ found) ** 2))


def _gradual_release(logs: Sequence[Log], releases: Sequence[float | None]) -> tuple[float, list[float | None]] | None:
    """Time constant T, s, of the gradual onset of the deceleration that all runs with a held speed show, and the time
    of each release with it, s; None where they show none.

    With S(T) the residual squares of a run of n bins, least over its release, the runs' gains n ln(S(0) / S(T)) for
    T = 0.5 s must have a mean above zero by a one-sided Student t test (``clutch_chance``). T is the shortest one whose
    mean gain is within one standard error of the largest, since longer ones cut more.

    Parameters
    ----------
    logs : whole, with ``speed``, m/s. releases : s, of each run, found without a lag; None: no held speed.
    """
    found = {
        k: fit
        for k, (log, release) in enumerate(zip(logs, releases, strict=True))
        if release is not None and (fit := _fits(log, release)) is not None
    }
    if len(found) < COASTDOWN_POLICY.clutch_runs:
        return None
    gains = np.array([gain for gain, _ in found.values()])
    if not _above_zero(gains[:, TESTED]):
        return None
    behind = gains[:, [int(np.argmax(gains.sum(axis=0)))]] - gains
    best = int(np.argmax(behind.mean(axis=0) <= _mean_error(behind)))
    at = {k: float(times[best]) for k, (_, times) in found.items()}
    return float(RELEASE_LAGS[best]), [at.get(k, release) for k, release in enumerate(releases)]


def _fits(log: Log, release: float) -> tuple[Array, Array] | None:
    """Gain n ln(S(0) / S(T)) and best release, s, of a run for each lag, (l,); None with too few rows."""
    there = np.isfinite(log["speed"]) & (log.time >= release - BEFORE) & (log.time <= release + AFTER)
    if there.sum() < FEWEST_ROWS or float(log.time[there][-1]) < release + 0.9 * AFTER:
        return None
    bins = cut(log.time[there], RELEASE_STEP)
    speed = bins.mean(log["speed"][there])
    tried = release + np.arange(-EARLIER, LATER, RELEASE_STEP)
    tried = tried[tried > bins.time[1]]
    if speed.size < FEWEST_ROWS or not tried.size:
        return None
    left = np.array([_squares(bins.time, speed, tried, lag) for lag in (0.0, *RELEASE_LAGS)])
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
