"""The lag of a filtered speed at the start of all coasts, and its removal.

A receiver that filters its speed with a time constant T delays the onset of the deceleration a where a coast begins at
constant speed::

    V(t) = V0 - a (t - T) - a T exp(-t/T) + curvature t^2

After a few T the filter is a pure delay, which changes no force. Before, the deceleration reads too small: fitted
without a cut, the drag area is up to 1.5 half-widths too small for T = 0.5 s. T and the amplitude of the exponential
are estimated from the first seconds of each run. A filter has the amplitude a T in every run, a clutch has the opposite
sign, and a gust or a road has another shape.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.gradual_release import gradual_release
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, KeptAndRejected, rows
from vdyn_cli.steps.coastdown.coasts.start_cuts import from_start, without_starts
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

LAGS = tuple(float(t) for t in np.geomspace(0.2, 1.6, 13))  # s, grid of T: shorter ones change no estimate
LENGTH = 4.5  # s of a run's start that are fitted: a parabola still describes the coast, and gusts change it little
SETTLED = 4.0  # time constants that are cut: 2 % of the transient are left
FEWEST_ROWS = 12  # samples of such a start, whose fit has four unknowns


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
    best: tuple[float, float, Array] | None = None
    for lag in LAGS:
        fits = [_exponential(log, lag) for log in logs]
        shares = np.array([f[0] for f in fits if f is not None])
        if shares.size < len(logs):
            continue
        misfit = float(np.mean([f[1] for f in fits if f is not None]))
        if best is None or misfit < best[0]:
            best = misfit, lag, shares
    if best is None:
        return None
    shares = best[2]
    mean, error = float(shares.mean()), float(shares.std(ddof=1)) / float(np.sqrt(shares.size))
    shown = mean > t_quantile(shares.size - 1, 1.0 - COASTDOWN_POLICY.clutch_chance) * error
    return best[1] if shown and abs(mean - 1.0) < COASTDOWN_POLICY.filter_share else None


def without_filtered_start(segments: Sequence[CoastSegment]) -> KeptAndRejected:
    """Coasts without the first seconds in which a filtered speed lags or the deceleration sets in, and those parts."""
    held = [s.held[1] - COASTDOWN_POLICY.held_release if s.held else None for s in segments]
    gradual = gradual_release([s.whole for s in segments], held)
    releases = gradual.releases if gradual else [None] * len(segments)
    starts = [
        from_start(one) if release is None else rows(one.whole, one.whole.time >= release)
        for one, release in zip(segments, releases, strict=True)
    ]
    lag = gradual.lag if gradual else filter_lag(starts)
    if lag is None:
        return list(segments), []
    if gradual:
        why = f"after the held speed the deceleration of all runs sets in with a time constant of {lag:.2g} s: "
        why += "filtered by the receiver, or a slow pedal?"
    else:
        why = f"the speed of all runs lags by {lag:.2g} s at the start of the coast: filtered by the receiver?"
    return without_starts(segments, starts, SETTLED * lag, lag, why)


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
