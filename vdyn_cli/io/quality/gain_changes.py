"""Detection of a gain that changes in the middle of a log, from physically related ("tied") channels.

For two tied channels, y = g x + c with one gain g, in windows of half a second, or four samples at low rates. Each
window is tried as the time of the change; the one with the least sum of squares gives the gains before and after.
A change of the speed's gain that the ratio to an acceleration does not show is found by the jump of the speed.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.vocabulary import WHEEL_SPEEDS

LOADS = ("front_left_load", "front_right_load", "rear_left_load", "rear_right_load")
LASTING = 40  # windows, 20 s: a hill of 300 m
AXLES = ("front_load", "rear_load")


@dataclass(frozen=True)
class Tie:
    """Two quantities with y = g x, plus c if ``constant``: ``time`` (s), ``y`` and ``x`` (w,) of windows.

    ``what`` names them in a message: "speed against position". ``change`` (w,) is by how much y is larger for each
    second by which x is late, such as the change of the speed for a distance; None if that resembles no change of gain.
    """

    what: str
    time: Array
    y: Array
    x: Array
    constant: bool
    change: Array | None = None


@dataclass(frozen=True)
class GainChange:
    """A change of a tie's gain at the time ``at`` (s) by ``factor``."""

    what: str
    at: float
    factor: float


def gain_changes(log: Log) -> tuple[GainChange, ...]:
    """The changes of the gain of all ties of a log that exceed ``least_gain_change`` and ``gain_change_t``.

    Parameters
    ----------
    log : channels in SI, NaN where a sample is missing or cut.
    """
    found = tuple(one for tie in _ties(log) if (one := changed_gain(tie)) is not None)
    return found if found else tuple(_jumps(log))


def gain_change_findings(log: Log) -> Iterator[Finding]:
    """A fault for each tie whose gain changes; the tie does not show which of its channels is wrong."""
    for one in gain_changes(log):
        what = (
            f"{one.what}: the ratio changes by {100 * (one.factor - 1.0):+.1f} % at {one.at:.1f} s: "
            "the gain of one of them changed"
        )
        remedy = f"cut the run with from_time or to_time: {one.at:.1f} s, or remove the wrong channel"
        yield Finding(log.name, what, "", remedy, fault=True, doubt=True)


def _jumps(log: Log) -> Iterator[GainChange]:
    """A change of the speed's gain by the jump of a moving car's speed that its acceleration does not contain.

    The jump exceeds the difference of both in any other window by ``jump_ratio``, and their standard deviation by
    ``gain_change_t``. A wrong fix jumps back, so that another window has the same difference.
    """
    name = "speed" if "speed" in log else "vehicle_speed"
    edges = _windows(log)
    if edges is None or not {name, "acceleration"} <= log.channels.keys():
        return
    speed = np.abs(log[name][edges])
    apart = np.diff(log[name][edges]) - _integrals(log.time, log["acceleration"], edges)
    moving = np.isfinite(apart) & (np.minimum(speed[1:], speed[:-1]) > QUALITY.rolling_speed)
    if np.count_nonzero(moving) < QUALITY.fewest_tie_windows:
        return
    apart, time, after = fast_changes(apart[moving]), log.time[edges[1:]][moving], log[name][edges[1:]]
    at = int(np.argmax(np.abs(apart)))
    jump, others = apart[at], np.delete(apart, at)
    beside = np.abs(np.arange(others.size) - at + 0.5) < 1.0  # a filtered jump lasts for two windows
    factor = 1.0 - float(jump / after[moving][at])
    largest = float(np.abs(others[~(beside & (others * jump > 0.0))]).max())
    least = max(QUALITY.jump_ratio * largest, QUALITY.gain_change_t * float(others.std()))
    sides = min(at, others.size - at) >= QUALITY.fewest_tie_windows // 3
    if sides and abs(jump) > least and abs(factor - 1.0) >= QUALITY.least_gain_change:
        yield GainChange(f"acceleration against {name}", float(time[at]), factor)


def _windows(log: Log) -> Rows | None:
    """The index of the first sample of each window; None for a log with too few windows."""
    if log.time.size < QUALITY.fewest_tie_windows:
        return None
    window = max(QUALITY.tie_window, QUALITY.window_samples * float(np.median(np.diff(log.time))))
    return None if log.duration < QUALITY.fewest_tie_windows * window else _edges(log.time, window)


def _ties(log: Log) -> Iterator[Tie]:
    name = "speed" if "speed" in log else "vehicle_speed"
    edges = _windows(log)
    if edges is None:
        return
    if name in log:
        if name == "speed":
            for wheel in WHEEL_SPEEDS:
                if wheel in log:
                    what = f"{wheel} against {name}"
                    yield _rolling(_mean_tie(what, log, edges, log[wheel], log[name], QUALITY.rolling_speed))
        if "position" in log:
            wide = _edges(log.time, max(log.duration / edges.size, log.duration / QUALITY.position_windows))
            moved = np.abs(np.diff(log["position"][wide]))
            driven = _integrals(log.time, np.abs(log[name]), wide)
            gained = np.diff(log[name][wide])
            yield _finite(Tie(f"position against {name}", log.time[wide[1:]], moved, driven, False, gained))
        if "acceleration" in log:
            gained = _integrals(log.time, log["acceleration"], edges)
            tie = Tie(f"acceleration against {name}", log.time[edges[1:]], gained, np.diff(log[name][edges]), True)
            yield _without_jump(_finite(tie))
    if "hub_torque" in log and "hub_force_x" in log:
        tie = _mean_tie("hub_torque against hub_force_x", log, edges, log["hub_torque"], log["hub_force_x"], 0.0)
        yield replace(tie, constant=True)
    loads = next((names for names in (LOADS, AXLES) if all(n in log for n in names)), ())
    if loads:
        total = np.sum([log[n] for n in loads], axis=0)
        ones = np.full(log.time.size, float(np.nanmedian(total)))
        yield _mean_tie("the sum of the loads against its median", log, edges, total, ones, 0.0)


def _edges(time: Array, length: float) -> Rows:
    """The index of the first sample of each window of ``length`` (s)."""
    return np.minimum(np.searchsorted(time, np.arange(time[0], time[-1], length)), time.size - 1)


def _mean_tie(what: str, log: Log, edges: Rows, y: Array, x: Array, least: float) -> Tie:
    """Means of both channels in each window, over samples with abs(x) above ``least``."""
    known = np.isfinite(y) & np.isfinite(x) & (np.abs(x) > least)
    count = np.diff(np.concatenate([[0], np.cumsum(known)])[edges])
    means = [
        np.diff(np.concatenate([[0.0], np.cumsum(np.where(known, v, 0.0))])[edges]) / np.maximum(count, 1)
        for v in (y, x)
    ]
    good = count > 0.5 * np.diff(edges)
    return Tie(what, log.time[edges[1:]][good], means[0][good], means[1][good], False)


def _rolling(tie: Tie) -> Tie:
    """The windows in which a wheel hardly slips."""
    if tie.x.size < QUALITY.fewest_tie_windows:
        return tie
    calm = np.abs(np.gradient(tie.x, tie.time)) <= QUALITY.calm_acceleration
    return Tie(tie.what, tie.time[calm], tie.y[calm], tie.x[calm], tie.constant)


def _integrals(time: Array, values: Array, edges: Rows) -> Array:
    """Integral over each window; NaN if a value is missing."""
    steps = np.diff(time) * (values[1:] + values[:-1]) / 2.0
    total = np.concatenate([[0.0], np.cumsum(np.nan_to_num(steps))])
    missing = np.concatenate([[0], np.cumsum(np.isnan(steps))])
    return np.where(np.diff(missing[edges]) > 0, np.nan, np.diff(total[edges]))


def _without_jump(tie: Tie) -> Tie:
    """The windows without the one in which y and x differ by ``jump_ratio`` times more than in any other.

    A speed jumps at the instant at which its gain changes; the square of that jump exceeds those of all other changes.
    """
    if tie.x.size < QUALITY.fewest_tie_windows:
        return tie
    apart = np.abs(tie.y - tie.x - np.median(tie.y - tie.x))
    largest = int(np.argmax(apart))
    if apart[largest] < QUALITY.jump_ratio * np.delete(apart, largest).max():
        return tie
    time, y, x = (np.delete(values, largest) for values in (tie.time, tie.y, tie.x))
    return replace(tie, time=time, y=y, x=x)


def fast_changes(values: Array) -> Array:
    """Values (w,) of windows minus their mean over the windows about each: without what changes slowly, as a slope."""
    width = min(2 * QUALITY.slow_windows + 1, values.size)
    kernel = np.ones(width)
    return np.asarray(values - np.convolve(values, kernel, "same") / np.convolve(np.ones(values.size), kernel, "same"))


def _finite(tie: Tie) -> Tie:
    good = np.isfinite(tie.y) & np.isfinite(tie.x)
    change = None if tie.change is None else np.nan_to_num(tie.change[good])
    return Tie(tie.what, tie.time[good], tie.y[good], tie.x[good], tie.constant, change)


def changed_gain(tie: Tie) -> GainChange | None:
    """The most likely change of a tie's gain; None if it is not significant, abrupt and large enough.

    It exceeds ``least_gain_change`` and ``gain_change_t``, and explains ``abrupt_explained`` of the squares that a
    cubic drift of the gain explains. Of a tie with a constant, which drifts as the hills in a specific force do, only
    the fast changes are compared, and the step explains ``stepped_share`` of what such a drift explains. It is no
    delay: when the pedal is released, a speed that is late by 0.25 s turns from 1 % too low to 1 % too high.
    """
    if tie.x.size < QUALITY.fewest_tie_windows:
        return None
    y, x = (fast_changes(tie.y), fast_changes(tie.x)) if tie.constant else (tie.y, tie.x)
    found = likely_change(y, x)
    if found is None:
        return None
    k, g, h, t, share = found
    if not g * h > 0.0 or abs(h / g - 1.0) < QUALITY.least_gain_change or t < QUALITY.gain_change_t:
        return None
    if min(_effective(x[:k]), _effective(x[k:])) < QUALITY.fewest_effective_windows:
        return None
    against = stepped_share(y, x, k, drift_design(x))
    least = QUALITY.stepped_share if tie.constant else QUALITY.abrupt_explained
    if (
        (1.0 - share) * against < least * (against - share)
        or _delayed(tie, k)
        or (tie.constant and not _both_ways(y, x, k, h / g))
    ):
        return None
    return GainChange(tie.what, float(tie.time[k - 1]), h / g)


def _effective(x: Array) -> float:
    """Number of windows on which the gain of x (n,) rests: (sum of x^2)^2 / sum of x^4."""
    return float(np.sum(x**2) ** 2 / np.sum(x**4))


def _delayed(tie: Tie, k: int) -> bool:
    """Whether a delay of x explains ``delayed_share`` of the squares that a change of the gain at index k explains."""
    if tie.change is None:
        return False
    constant = tie.x[:, None]
    step, delay = (stepped_share(tie.y, tie.x, k, rival) for rival in (constant, np.c_[constant, tie.change]))
    return 1.0 - step / delay >= QUALITY.delayed_share * (1.0 - step)


def likely_change(y: Array, x: Array) -> tuple[int, float, float, float, float] | None:
    """The index k at which y = g x before and y = h x after leave the least sum of squares: (k, g, h, t, share).

    t is the difference of both gains in standard errors, the larger of those by the residual's autocorrelation at one
    lag (-0.5 for the changes of a noisy position, as neighbors share a reading) and by the autocovariances of x times
    residual: what else y contains, such as the road's slope in a specific force, lasts for many windows. ``share`` is
    the sum of squares relative to that with one gain. None if no k leaves enough of x on both sides.

    Parameters
    ----------
    y, x : (n,).
    """
    n = x.size
    least = max(QUALITY.fewest_tie_windows // 3, 3)
    if n < QUALITY.fewest_tie_windows or not np.any(x):
        return None
    xx, xy, yy = (np.cumsum(v) for v in (x * x, x * y, y * y))
    at = np.arange(least, n - least + 1)
    before, after = xx[at - 1], xx[-1] - xx[at - 1]
    usable = np.minimum(before, after) > QUALITY.least_tie_share * xx[-1]
    if not usable.any():
        return None
    at, before, after = at[usable], before[usable], after[usable]
    first, second = xy[at - 1] / before, (xy[-1] - xy[at - 1]) / after
    left = yy[-1] - first**2 * before - second**2 * after
    best = int(np.argmin(left))
    k, g, h = int(at[best]), float(first[best]), float(second[best])
    residual = y - np.where(np.arange(n) < k, g, h) * x
    squares = float(residual @ residual)
    lag = float(np.clip(residual[1:] @ residual[:-1] / max(squares, 1e-300), -0.5, 0.9))
    variance = squares / max(n - 3, 1) * (1.0 + lag) / (1.0 - lag)
    white = variance * (1.0 / before[best] + 1.0 / after[best])
    lasting = (
        long_run_variance(x[:k] * residual[:k]) / before[best] ** 2
        + long_run_variance(x[k:] * residual[k:]) / after[best] ** 2
    )
    t = abs(h - g) / np.sqrt(max(white, lasting, 1e-300))
    return k, g, h, float(t), squares / max(float(yy[-1] - xy[-1] ** 2 / xx[-1]), 1e-300)


def long_run_variance(u: Array) -> float:
    """Variance of the sum of u (n,) with its autocovariances up to ``LASTING`` lags, by Bartlett's weights.

    Source: Newey and West, Econometrica 55 (1987) 703.
    """
    lags = range(1, min(LASTING, u.size // 4) + 1)
    return float(u @ u + 2.0 * sum((1.0 - k / (len(lags) + 1)) * (u[k:] @ u[:-k]) for k in lags))


def _both_ways(y: Array, x: Array, k: int, factor: float) -> bool:
    """Whether the regression of x on y also shows at least half of the gain's change.

    Noise of x lowers the gain of y on x, and other contents of y (the road's slope in a specific force) affect that of
    x on y, the more the gentler the drive: the true gain lies between both.
    """
    halves = (slice(0, k), slice(k, None))
    before, after = (float(y[h] @ y[h]) / (float(x[h] @ y[h]) or np.inf) for h in halves)
    return before * after > 0.0 and bool(np.log(after / before) * np.sign(factor - 1.0) > 0.5 * abs(np.log(factor)))


def drift_design(x: Array) -> Array:
    """Design (n, 4) for a gain of x (n,) that drifts as a cubic in time."""
    return np.asarray((np.arange(x.size) / x.size)[:, None] ** np.arange(4) * x[:, None])


def stepped_share(y: Array, x: Array, k: int, rival: Array) -> float:
    """The residual sum of squares with a step of the gain, relative to that with an alternative design.

    Parameters
    ----------
    y, x : (n,) the two tied channels, y = gain x. k : index of the first sample after the step.
    rival : (n, m), columns of the alternative.
    """

    def squares(design: Array) -> float:
        residual = y - design @ np.linalg.lstsq(design, y, rcond=None)[0]
        return float(residual @ residual)

    return squares(np.column_stack([x, x * (np.arange(x.size) >= k)])) / max(squares(rival), 1e-300)
