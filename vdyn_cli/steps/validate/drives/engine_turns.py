"""The gears of drives with a logged engine speed: the angle by which the engine turns per distance.

In a gear, om/V is constant, and returns in all drives. Levels of it are searched in the time of all drives together,
that with the longest time first. A clutch that slips, a converter, neutral or a continuously variable ratio have no
level; the engine's angle per distance is zero there, because its inertia then does not act by this law.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from vdyn_cli.inference.robust_fits import huber_fit
from vdyn_cli.physics.models.road_load import ENGINE_TURNS
from vdyn_cli.quantities.arrays import Array, filled
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.driven_samples import Driven, driven_samples, joined
from vdyn_cli.steps.validate.drives.span_averages import SPAN, slope_over_span
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

ENGINE_SPEED = "motor_speed"
SLOWEST = 1.0  # m/s, below which clutches slip and the quantization of the speed is large
LONGEST_GAP = 0.5  # s, between values of the engine speed that are interpolated
SHORTEST_STRETCH = 0.5  # s in a gear: a shift passes through levels in less
FEWEST_DRIVEN = 60  # samples from which the engine's share is estimated: ten for each unknown


def with_engine_turns(logs: Sequence[Log]) -> tuple[Log, ...]:
    """The logs with the engine's angle per distance, (n,) rad/m, as the channel ``ENGINE_TURNS``; 0 without a gear.

    The logs themselves where a log lacks the engine speed, where the car is not mostly in gears, or where there are
    fewer than two: with one ratio, the engine is a part of the rotating mass.

    Parameters
    ----------
    logs : with speed (m/s) and motor_speed (rad/s, may contain NaN).
    """
    if not all(ENGINE_SPEED in log for log in logs):
        return tuple(logs)
    turns, durations = [_turns(log) for log in logs], [_durations(log.time) for log in logs]
    levels = gear_levels(np.concatenate(turns), np.concatenate(durations))
    if levels.size < 2:
        return tuple(logs)
    found = [in_gears(log.time, own, levels) for log, own in zip(logs, turns, strict=True)]
    known, geared = (
        sum(float(d @ mask(x)) for d, x in zip(durations, of, strict=True))
        for of, mask in ((turns, np.isfinite), (found, np.sign))
    )
    if geared < VALIDATE_POLICY.gear_cover * known:
        return tuple(logs)
    return tuple(log.with_channels(**{ENGINE_TURNS: own}) for log, own in zip(logs, found, strict=True))


def gear_levels(turns: Array, duration: Array) -> Array:
    """The levels (m,) of the engine's angle per distance that are gears, rad/m, those of the longest time first.

    Parameters
    ----------
    turns : (n,) rad/m, NaN where unknown. duration : (n,) s, of each sample.
    """
    width, core = np.log1p(VALIDATE_POLICY.gear_width), np.log1p(VALIDATE_POLICY.gear_core)
    known = np.isfinite(turns)
    order = np.argsort(turns[known])
    x, time = np.log(turns[known][order]), duration[known][order]
    found = []
    while x.size:
        total = np.r_[0.0, np.cumsum(time)]
        within = [total[np.searchsorted(x, x + w, "right")] - total[np.searchsorted(x, x - w)] for w in (core, width)]
        best = int(np.argmax(within[0]))
        if within[0][best] < VALIDATE_POLICY.gear_time:
            break
        if within[0][best] > VALIDATE_POLICY.gear_share * within[1][best]:
            found.append(float(np.exp(np.median(x[np.abs(x - x[best]) <= core]))))
        rest = np.abs(x - x[best]) > width
        x, time = x[rest], time[rest]
    return np.array(found)


def in_gears(time: Array, turns: Array, levels: Array) -> Array:
    """The level (n,) of the gear that the car is in, rad/m; 0 elsewhere.

    Parameters
    ----------
    time : (n,) s. turns : (n,) measured, rad/m, NaN where unknown. levels : (m,) rad/m, of the gears.
    """
    off = np.abs(np.log(turns[:, None] / levels))
    nearest = np.where(np.isfinite(turns), np.argmin(np.where(np.isnan(off), np.inf, off), axis=1), 0)
    near = off[np.arange(turns.size), nearest] <= np.log1p(VALIDATE_POLICY.gear_width)
    gear, found = np.where(near, nearest, -1), np.zeros(turns.size)
    edges = [0, *(np.flatnonzero(np.diff(gear)) + 1).tolist(), turns.size]
    for a, b in pairwise(edges):
        if gear[a] >= 0 and time[b - 1] - time[a] >= SHORTEST_STRETCH:
            found[a:b] = levels[gear[a]]
    return found


def without_engine_share(drives: Sequence[Driven]) -> list[Driven]:
    """The drives with their torques less the share that accelerates the engine, for checks of the car's motion.

    V' = a T + b + c V^2 + d T' - j n^2 V' in all drives together; the share of T is j n^2 V' / a, with j >= 0. The
    drives themselves where the engine's angle per distance n is not known.

    Parameters
    ----------
    drives : of one car.
    """
    if not all(ENGINE_TURNS in channels for _, channels, _ in drives):
        return list(drives)
    pulled = [channels[ENGINE_TURNS] ** 2 * _speed_slope(time, channels["speed"]) for time, channels, _ in drives]
    seen = [driven_samples(*drive, SPAN) for drive in drives]
    own = [np.interp(s.time, time, p) for s, (time, _, _), p in zip(seen, drives, pulled, strict=True)]
    rate, columns = joined(seen)
    if rate.size < FEWEST_DRIVEN:
        return list(drives)
    found, _ = huber_fit(np.column_stack([columns, -np.concatenate(own)]), rate)
    share = max(float(found[-1]), 0.0) / float(found[0]) if found[0] > 0.0 else 0.0
    return [(time, channels, torque - share * p) for (time, channels, torque), p in zip(drives, pulled, strict=True)]


def _speed_slope(time: Array, speed: Array) -> Array:
    return slope_over_span(time, filled(time, speed))


def _turns(log: Log) -> Array:
    """The engine's angle per distance (n,), rad/m; NaN in gaps, below ``SLOWEST``, and while the engine rests."""
    there = np.isfinite(log[ENGINE_SPEED])
    if np.count_nonzero(there) < 2:
        return np.full(log.time.size, np.nan)
    at = log.time[there]
    after = np.clip(np.searchsorted(at, log.time), 1, at.size - 1)
    gap = at[after] - at[after - 1]
    engine, speed = np.interp(log.time, at, log[ENGINE_SPEED][there]), filled(log.time, log["speed"])
    known = (there | (gap <= LONGEST_GAP)) & (speed > SLOWEST) & (engine > 0.0)
    return np.where(known, engine / np.where(known, speed, 1.0), np.nan)


def _durations(time: Array) -> Array:
    """Duration (n,) of each sample, s."""
    steps = np.diff(time)
    return np.append(np.minimum(steps, LONGEST_GAP), 0.0)
