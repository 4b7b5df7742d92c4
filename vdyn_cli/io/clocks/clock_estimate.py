"""Delay and drift between two loggers' clocks, from physically related channels or as stated.

A coarse search over all delays (``coarse_delay``) precedes a least-squares fit (``delay_fit``). The drift is corrected
only if the logs determine it.
"""

from __future__ import annotations

import numpy as np

from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.clocks.coarse_delay import MOST_POINTS, OTHER_CHANNELS, coarse_delay, compared_means
from vdyn_cli.io.clocks.delay_fit import WIDTHS, CellMeans, best_delay_fit
from vdyn_cli.io.clocks.sampled_signal import FINE, Signal
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given

_LEAST_READINGS = 20  # below, two recordings can be similar by chance at some delay
_DRIFT_ROUNDS = 4


def clock_difference(reference: Log, other: Log, tie: ChannelTie) -> ClockDifference:
    """Estimate delay and drift of another logger's clock from two physically related channels.

    The drift, with the prior of quartz clocks, is corrected if it exceeds ``drift_determined`` standard errors; the
    delay is then estimated together with it.

    Parameters
    ----------
    reference, other : logs that overlap by at least half of the shorter one. tie : the two channels.

    Raises
    ------
    InputError : a channel is missing, varies too little or too uniformly, matches at no delay or at several, or the
        drift is larger than that of any clock.
    """
    x, y = _signal(reference, tie.first), _signal(other, tie.second)
    where = f"{other.name}, {tie}"
    coarse = coarse_delay(x, y, tie, where)
    span = float(np.ptp(x.time) + np.ptp(y.time))
    width = max(WIDTHS[0] * max(x.step, y.step), FINE * span / MOST_POINTS)
    grids = tuple(np.arange(s.time[0], s.time[-1], width / FINE) for s in (x, y))
    means = tuple(
        compared_means(s, grid, width / FINE, tie, k) for k, (s, grid) in enumerate(zip((x, y), grids, strict=True))
    )
    rolling = _rolling(tie)
    speed = None if rolling is None else (x, y)[rolling].averages(grids[rolling], width / FINE)
    cells = CellMeans(grids, means, width, tie, rolling, speed)
    first = best_delay_fit(cells, coarse, 0.0, 0.0)
    if first is None:
        what = "varies too little or too uniformly to separate a delay from a gain and an offset"
        remedy = f"record acceleration and braking as well, {OTHER_CHANNELS}"
        raise InputError(Finding(where, what, remedy=remedy))
    at = first.at - first.delay
    found, corrected, settled = first, False, False
    drift, std = _with_prior(first.drift, first.drift_std)
    for _ in range(_DRIFT_ROUNDS):
        if settled or abs(drift) <= CLOCKS.drift_determined * std:
            break
        later = best_delay_fit(cells, found.delay, drift, at)
        if later is None:
            break
        found, corrected, before = later, True, drift
        drift, std = _with_prior(before + later.drift, later.drift_std)
        settled = abs(drift - before) < 0.1 * std
    if abs(drift) <= CLOCKS.drift_determined * std:
        found, corrected = first, False
    _check_drift(drift, std, where)
    return ClockDifference(
        run=reference.name,
        logger=other.name,
        pair=(tie.first, tie.second),
        delay=found.delay,
        delay_std=found.std,
        at=at,
        drift=drift,
        drift_std=std,
        corrected=corrected,
        gain=found.gain,
        offset=found.offset,
        channels=(),
    )


def stated_difference(reference: Log, other: Log, delay: Given) -> ClockDifference:
    """The difference of two clocks whose delay is known; a delay with an uncertainty has the drift prior of quartz.

    Parameters
    ----------
    reference, other : the logs.
    delay : time by which the other's clock is ahead, s; std 0 if both loggers share one clock.

    Raises
    ------
    InputError : with this delay the logs do not overlap enough.
    """
    (first, last), (start, stop) = ((log.time[0], log.time[-1]) for log in (reference, other))
    together = min(last, stop - delay.value) - max(first, start - delay.value)
    if together < CLOCKS.least_overlap * min(last - first, stop - start):
        what = f"does not overlap {reference.name} enough with the stated delay"
        got = f"{start:.6g} s to {stop:.6g} s, minus {delay.value:.6g} s, against {first:.6g} s to {last:.6g} s"
        remedy = "correct 'delay' (time on this clock minus time on the first logger's clock), or remove it"
        raise InputError(Finding(other.name, what, got, remedy))
    drift_std = CLOCKS.prior_drift if delay.std > 0.0 else 0.0
    at = float(np.mean(reference.time[[0, -1]]))
    return ClockDifference(
        run=reference.name,
        logger=other.name,
        pair=("time", "time"),
        delay=delay.value,
        delay_std=delay.std,
        at=at,
        drift=0.0,
        drift_std=drift_std,
        corrected=False,
        gain=1.0,
        offset=0.0,
        channels=(),
    )


def _with_prior(drift: float, std: float) -> tuple[float, float]:
    """Combine a measured drift and its standard error with the prior of quartz clocks.

    A drift that contradicts the prior is returned as measured.

    Parameters
    ----------
    drift, std : s/s; an infinite std returns the prior.
    """
    if abs(drift) > CLOCKS.prior_contradicted * float(np.hypot(std, CLOCKS.prior_drift)):
        return drift, std
    weight = CLOCKS.prior_drift**2 / (CLOCKS.prior_drift**2 + std**2)
    return weight * drift, CLOCKS.prior_drift * float(np.sqrt(1.0 - weight))


def _check_drift(drift: float, std: float, where: str) -> None:
    """Refuse a drift larger than that of any clock.

    Raises
    ------
    InputError : the drift exceeds ``most_drift``; this happens only where the data contradict the prior.
    """
    if abs(drift) > CLOCKS.most_drift:
        what = "the clocks drift apart too fast: the logs are of different runs or a channel is faulty"
        got = (
            f"{1e6 * drift:+.0f} ppm +- {1e6 * std:.0f} ppm; quartz clocks drift by {1e6 * CLOCKS.prior_drift:.0f} ppm"
        )
        remedy = "check which logs belong to this run, and the unit and the sampling rate of their times; or "
        raise InputError(Finding(where, what, got, f"{remedy}{OTHER_CHANNELS}"))


def _rolling(tie: ChannelTie) -> int | None:
    """Which channel (0, 1) gives the speed in the slip term: the vehicle's speed, else the wheel's; None if no slip."""
    if tie.wheel is None:
        return None
    return 1 - tie.wheel if tie.order == 0 else tie.wheel


def _signal(log: Log, channel: str) -> Signal:
    if channel not in log or channel == "time":
        remedy = f"map it for every logger, {OTHER_CHANNELS}"
        raise InputError(Finding(log.name, f"has no channel '{channel}' to align the loggers on", remedy=remedy))
    written = np.isfinite(log[channel])
    values = log[channel][written]
    if values.size < _LEAST_READINGS:
        what = f"channel '{channel}' has {values.size} readings: {_LEAST_READINGS} are needed to align the clocks"
        raise InputError(Finding(log.name, what, remedy=OTHER_CHANNELS))
    if np.ptp(values) == 0.0:
        what = f"channel '{channel}' is constant: it cannot align the loggers' clocks"
        raise InputError(Finding(log.name, what, remedy=OTHER_CHANNELS))
    return Signal(log.time[written], values)
