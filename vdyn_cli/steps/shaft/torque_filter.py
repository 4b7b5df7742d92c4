"""The low-pass filter of a logged torque, from the logs.

A torque behind a filter F that twist and speeds do not have reads F (k phi + c phi'). As F is linear, that is
k (F phi) + c (F phi'): the logs are evaluated with twist and rate behind the same filter. It is sought where the fit
leaves a residual above the noise that no delay of the torque explains, and accepted where it explains that with a
physical damping. To first order a time constant t is a damping that is too small by k t; what determines it is the
second order, k t^2 phi''.

With one pole and a damping c above k t the same law is that of a shaft with a viscoelastic joint (Zener's standard
linear solid): k in slow oscillations, with the damping c - k t, and a stiffness of c / t in fast ones.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.shaft.noise import GAP
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings
from vdyn_cli.steps.shaft.spec import SideName
from vdyn_cli.steps.shaft.torque_clock import FEWEST_INNER, Readings, shaft_fits, unexplained_squares

SHORTEST, LONGEST, TRIALS = 5e-4, 0.1, 30  # s: corners of 320 to 1.6 Hz, and the number of trials in each order
ORDERS = (1, 2, 4)  # one pole; Butterworth
FINER = 16  # points per sample, between which the signal is a line; the curve through them is cubic
FORGOTTEN = 5.0  # time constants from the start of a run, in which the filter follows an unknown history
APART = 0.02  # of the time constant, between the fits whose costs give its standard deviation


@dataclass(frozen=True)
class TorqueFilter:
    """A low-pass filter of the torque.

    Parameters
    ----------
    time : s, its time constant, 1 / (2 pi corner). order : 1, or that of a Butterworth filter.
    of_shaft : whether the torque itself lags, in a viscoelastic shaft, and not its sensor.
    """

    time: float
    order: int
    of_shaft: bool = False

    @property
    def relaxation(self) -> float:
        """The relaxation time of a viscoelastic shaft, s, 0 for a sensor's filter."""
        return self.time if self.of_shaft else 0.0

    def through(self, readings: Readings) -> dict[SideName, tuple[ShaftReadings, ...]]:
        """The readings of all sides, as :meth:`applied`."""
        return {side: tuple(self.applied(run) for run in runs) for side, runs in readings.items()}

    def applied(self, run: ShaftReadings) -> ShaftReadings:
        """The readings with twist and rate behind this filter, from ``FORGOTTEN`` time constants on."""
        later = run.time >= run.time[0] + FORGOTTEN * self.time
        twist, rate = (self._filtered(run.time, signal)[later] for signal in (run.twist, run.rate))
        torque, twist_noise, rate_noise = run.noise
        less = self._noise_gain(run.time)
        noise = torque, twist_noise * less, rate_noise * (1.0 if run.rate_unread else less)
        motor = self._filtered(run.time, run.motor_speed)[later] if run.motor_speed.size else run.motor_speed
        of_motor = motor, run.motor_noise * less
        return ShaftReadings(run.name, run.time[later], run.torque[later], twist, rate, noise, *of_motor)

    def _noise_gain(self, time: Array) -> float:
        """Standard deviation of white noise behind this filter, over that before it."""
        impulse = np.zeros(time.size)
        impulse[time.size // 2] = 1.0
        return float(np.linalg.norm(self._filtered(time, impulse)))

    def _filtered(self, time: Array, signal: Array) -> Array:
        """The signal (n,) behind the filter, which is steady at first."""
        from scipy.interpolate import CubicSpline
        from scipy.signal import butter, cont2discrete, lfilter, lfilter_zi

        step = float(np.median(np.diff(time))) / FINER
        grid = np.arange(time[0], time[-1] + step, step)
        above, below = butter(self.order, 1.0 / self.time, analog=True)
        steps, below, _ = cont2discrete((above, below), step, method="foh")
        fine = CubicSpline(time, signal)(np.minimum(grid, time[-1]))
        start = lfilter_zi(steps.ravel(), below) * fine[0]
        return np.asarray(np.interp(time, grid, lfilter(steps.ravel(), below, fine, zi=start)[0]))


def torque_filter(readings: Readings) -> tuple[TorqueFilter | None, float, tuple[Finding, ...]]:
    """The filter of the torque, the standard deviation of its time constant in s, and a finding; None, 0 without one.

    Parameters
    ----------
    readings : of the logs, with a delay of the torque compensated.
    """
    before, runs = shaft_fits(readings), [run for side in readings.values() for run in side]
    if before is None or before.excess <= SHAFT_POLICY.shaft_excess or any(_broken(run) for run in runs):
        return None, 0.0, ()
    found = min((_best(runs, order) for order in ORDERS), key=lambda one: _cost(runs, one))
    fits = [_cost(runs, replace(found, time=found.time * (1.0 + apart))) for apart in (-APART, 0.0, APART)]
    bend = (fits[0] - 2.0 * fits[1] + fits[2]) / (APART * found.time) ** 2
    after = shaft_fits(found.through(readings))
    if bend <= 0.0 or after is None or not after.physical or after.excess > SHAFT_POLICY.shaft_excess:
        return None, 0.0, ()
    std = after.excess * (2.0 / bend) ** 0.5  # the cost is twice the negative log likelihood
    excess = f"residual {before.excess:.1f} times the noise without it, {after.excess:.1f} times with it"
    if after.damping_time <= found.time:
        return found, std, (_filtered_torque(found, excess),)
    if found.order > 1:
        return None, 0.0, ()
    return replace(found, of_shaft=True), std, (_viscoelastic(found, after.damping_time / found.time - 1.0, excess),)


def _filtered_torque(found: TorqueFilter, excess: str) -> Finding:
    corner, kind = 1.0 / (2.0 * np.pi * found.time), f"{found.order} poles" if found.order > 1 else "one pole"
    what = f"is logged behind a low-pass filter of {corner:.3g} Hz ({kind}); twist and rate are filtered likewise"
    remedy = "log the torque without this filter, or twist and speeds with the same one"
    return Finding("channel 'shaft_torque'", what, excess, remedy, fault=True, doubt=True)


def _viscoelastic(found: TorqueFilter, stiffer: float, excess: str) -> Finding:
    """The finding that a shaft is ``stiffer`` in fast oscillations, relative to slow ones."""
    what = (
        f"the shaft or a joint is viscoelastic: {100 * stiffer:.0f} % stiffer in fast oscillations than in slow ones, "
        f"with a relaxation time of {1e3 * found.time:.2g} ms; stiffness and damping are those of slow oscillations"
    )
    remedy = f"use them below {0.5 / (2.0 * np.pi * found.time):.2g} Hz, or simulate a Zener shaft"
    return Finding("shaft_stiffness", what, excess, remedy, doubt=True)


def _broken(run: ShaftReadings) -> bool:
    """Whether a run has a gap, over which no filter can be followed, or is too short for the longest one."""
    step = np.diff(run.time)
    return bool((step > GAP * np.median(step)).any() or np.ptp(run.time) < 2.0 * FORGOTTEN * LONGEST)


def _best(runs: Sequence[ShaftReadings], order: int) -> TorqueFilter:
    """The filter of an order with which torque is best proportional to filtered twist and rate."""
    from scipy.optimize import minimize_scalar

    trials = np.geomspace(SHORTEST, LONGEST, TRIALS)
    costs = [_cost(runs, TorqueFilter(float(t), order)) for t in trials]
    k = int(np.argmin(costs))
    low, high = np.log(trials[max(k - 1, 0)]), np.log(trials[min(k + 1, TRIALS - 1)])
    found = minimize_scalar(
        lambda x: _cost(runs, TorqueFilter(float(np.exp(x)), order)), bounds=(low, high), method="bounded"
    )
    return TorqueFilter(float(np.exp(found.x)), order)


def _cost(runs: Sequence[ShaftReadings], one: TorqueFilter) -> float:
    """Sum of squares of the torque, N m, that filtered twist and rate leave, each run with its zero and drift."""
    cost = 0.0
    for run in runs:
        read = one.applied(run)
        inner = read.time >= run.time[0] + FORGOTTEN * LONGEST  # the same samples in every trial
        if np.count_nonzero(inner) >= FEWEST_INNER:
            cost += unexplained_squares(read, inner, [read.torque[inner]])[0] / run.noise[0] ** 2
    return cost
