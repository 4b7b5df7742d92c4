"""The delay of a logged torque behind the twist of the same shaft, from the logs.

To first order a delay d is a damping that is too small by k d: k phi(t - d) = k phi - k d phi'. Logs of tip-ins hardly
contain the second order, so that only the sum c - k d is determined: the delay within the damping times c / k of
half-shafts, and the stiffness. Of the delays within these times the likeliest one that fits no worse than the others is
taken, since an accurate torque shows the second order. A delay is sought where the fit without one leaves a residual
above the noise, or a negative damping. It is accepted where it leaves a smaller residual, within the noise, and a
physical damping. The logs are then evaluated with the torque shifted, as with a stated delay, and the uncertainty of
the damping time is that of the delay.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.shaft_fit import MOST_DAMPING, linear_solution, noise_excess
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings
from vdyn_cli.steps.shaft.spec import SideName

Readings = Mapping[SideName, tuple[ShaftReadings, ...]]
LONGEST, STEP = 0.2, 2e-3  # s: the longest delay tried (telemetry: a few hundredths), and the distance of trials
# s, c / k of half-shafts: 1 to 10 ms of steel (MOST_DAMPING), and the standard deviation of a delay for want of it.
DAMPING_TIME, UNKNOWN = 5e-3, 3e-3
WITHIN = np.array([0.0, -0.5, 0.5, -1.0, 1.0])  # of UNKNOWN, from the delay with DAMPING_TIME, that are fitted exactly
ALIKE = 1.1  # ratio of two residuals, as the noise is known to 10 %; interpolation between samples changes one by 3 %
FEWEST_INNER = 10  # samples of a run that are compared with trials


@dataclass(frozen=True)
class ShaftFits:
    """The fits to all logged sides with one delay or filter of the torque.

    Parameters
    ----------
    excess : of the residuals, times the sensors' noise. physical : no damping is significantly negative, or that of
        friction.
    """

    solutions: tuple[Solution, ...]
    excess: float
    physical: bool

    @property
    def damping_time(self) -> float:
        """c / k, s, the mean of the sides."""
        return float(np.mean([s.values["shaft_damping"] / s.values["shaft_stiffness"] for s in self.solutions]))


def assumed_delay(logs: Sequence[Log], apart: float = 0.0) -> Given:
    """The delay of a torque, s, about which nothing is stated: 0 +- half a sampling interval.

    Channels of one row may be sampled up to an interval apart, and an anti-alias filter of one channel alone, a
    Butterworth filter of two poles at 0.4 of the sampling rate, delays it by half an interval.

    Parameters
    ----------
    logs : of all runs; the one with the longest interval counts.
    apart : s, delay between the sensors of the two ends, where one was found: the torque may be as far from either.
    """
    clocks = [log.samples["shaft_torque"][0] if "shaft_torque" in log.samples else log.time for log in logs]
    interval = max((float(np.median(np.diff(clock))) for clock in clocks), default=0.0)
    return Given(0.0, float(np.hypot(0.5 * interval, apart)))


def torque_delay(read: Callable[[float], Readings], stated: Given) -> tuple[Given, tuple[Finding, ...]]:
    """The delay of the torque, s, with a finding where the logs show another one than stated.

    Parameters
    ----------
    read : the readings with a delay of the torque in s compensated.
    stated : the delay of the description, s; it stands where the logs do not contradict it.
    """
    before = shaft_fits(read(stated.value))
    if before is None or (before.physical and before.excess <= SHAFT_POLICY.shaft_excess):
        return stated, ()
    near = stated.value + _start([run for runs in read(stated.value).values() for run in runs])
    about = _tried(read, near)
    if about is None:
        return stated, ()
    likely = near + DAMPING_TIME - about.damping_time
    tried = {delay: _tried(read, delay) for delay in likely + UNKNOWN * WITHIN}
    fits = {delay: one for delay, one in tried.items() if one is not None and one.physical}
    if not fits:
        return stated, ()
    least = min(one.excess for one in fits.values())
    found = Given(float(next(delay for delay, one in fits.items() if one.excess <= ALIKE * least)), UNKNOWN)
    after = fits[found.value]
    if after.excess > SHAFT_POLICY.shaft_excess:
        return stated, ()
    if abs(found.value - stated.value) < SHAFT_POLICY.delay_std * found.std:
        return stated, ()
    if before.excess <= ALIKE * after.excess:
        return stated, ()  # a negative damping alone does not determine the delay
    late = f"{1e3 * abs(found.value):.0f} +- {1e3 * found.std:.0f} ms {'late' if found.value > 0 else 'early'}"
    what = f"is logged {late} relative to the twist, and is shifted by that"
    got = f"residual {before.excess:.1f} times the noise without the shift, {after.excess:.1f} times with it"
    state = f"'torque_delay: {1e3 * found.value:.0f} +- 0.1 ms'"
    remedy = f"measure the delay, and write it under settings as {state}; damping is then determined"
    return found, (Finding("channel 'shaft_torque'", what, got, remedy, fault=True, doubt=True),)


def shaft_fits(readings: Readings) -> ShaftFits | None:
    """The fits to the readings of each side without effects; None if one of them fails, or nothing was read."""
    sides = [runs for runs in readings.values() if runs]
    if not sides:
        return None
    try:
        solutions = [linear_solution(runs) for runs in sides]
    except ResultError:
        return None
    every = [run for runs in sides for run in runs]
    return ShaftFits(tuple(solutions), noise_excess(solutions, every), all(_physical(s) for s in solutions))


def _tried(read: Callable[[float], Readings], delay: float) -> ShaftFits | None:
    try:
        return shaft_fits(read(delay))
    except InputError:
        return None


def _physical(solution: Solution) -> bool:
    damping, margin = solution.values["shaft_damping"], NORMAL95 * solution.std["shaft_damping"]
    return -margin < damping < MOST_DAMPING * solution.values["shaft_stiffness"] + margin


def _start(runs: Sequence[ShaftReadings]) -> float:
    """The delay, s, with which torque is best proportional to twist and rate, each run with its zero and drift."""
    delays = np.arange(-LONGEST, LONGEST + STEP / 2, STEP)
    costs = np.zeros(delays.size)
    for run in runs:
        inner = (run.time > run.time[0] + LONGEST) & (run.time < run.time[-1] - LONGEST)
        if np.count_nonzero(inner) < FEWEST_INNER:
            continue
        earlier = (np.interp(run.time[inner] + delay, run.time, run.torque) for delay in delays)
        costs += unexplained_squares(run, inner, earlier)
    return float(delays[np.argmin(costs)])


def unexplained_squares(run: ShaftReadings, inner: Mask, torques: Iterable[Array]) -> list[float]:
    """Sum of squares of each torque, N m, that twist and rate of a run leave, with a zero and a drift.

    Parameters
    ----------
    inner : (n,) mask of the samples that are used. torques : (m,) each, at these samples.
    """
    columns = np.column_stack([np.ones(run.time.size), run.time - run.time[0], run.twist, run.rate])[inner]
    basis = np.linalg.qr(columns / np.abs(columns).max(axis=0))[0]
    return [float(np.sum(torque**2) - np.sum((basis.T @ torque) ** 2)) for torque in torques]
