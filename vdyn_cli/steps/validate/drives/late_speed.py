"""Detects a speed on another clock than the drive torque: half a second and more before or after it.

With the torques tau seconds before the reading of the speed, its rate is

    V'(t) = a T(t - tau) + d B(t - tau) + b + c V(t)^2

T the drive torque, B the brake torque. The delay is the tau of the least squares. The latency of a logger is part of
the fit of the drives; a delay beyond it exceeds the time in which a drive torque changes, so that no linearization at
zero delay reaches it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array, filled
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.driven_samples import SLOWEST
from vdyn_cli.steps.validate.drives.segments import total_drive_torque
from vdyn_cli.steps.validate.drives.span_averages import level_rate, mean_over_span
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY

LONGEST = 3.0  # s, delay that is searched
STEP = 0.1  # s between delays, and between samples
LASTING = 3.0  # s that an error of the rate lasts, mostly of gusts and hills
SHORTEST_DRIVE = 60.0  # s of samples, of which a delay is estimated


def with_speed_on_time(logs: Sequence[Log]) -> tuple[tuple[Log, ...], tuple[Finding, ...]]:
    """The logs with a speed that is late or early shifted to the clock of the torque, and a finding on each."""
    found: list[Finding] = []
    right = []
    for log in logs:
        delay = speed_delay_of(log)
        right.append(_shifted(log, delay) if delay else log)
        if delay:
            what = (
                f"lags the drive torque by {delay:.1f} s" if delay > 0 else f"leads the drive torque by {-delay:.1f} s"
            )
            what += " (+- 0.1 s): the clocks of the two differ; it is shifted by that time"
            remedy = "check the clocks: list each logger under 'loggers', or use a speed with less latency"
            found.append(Finding(f"{log.name}, channel 'speed'", what, "", remedy, doubt=True))
    return tuple(right), tuple(found)


def speed_delay_of(log: Log) -> float:
    """The delay of the speed after the torque, s, a multiple of ``STEP``; 0 where it is short or not certain."""
    if not any(n in log for n in ("drive_torque", "drive_torque_left")) or log.time[-1] - log.time[0] < SHORTEST_DRIVE:
        return 0.0
    time = np.arange(log.time[0], log.time[-1], STEP)
    on_grid = {n: filled(time, np.interp(time, log.time, filled(log.time, v))) for n, v in log.channels.items()}
    speed, torque = on_grid["speed"], mean_over_span(time, total_drive_torque(on_grid))
    brake = mean_over_span(time, on_grid["brake_torque"]) if "brake_torque" in on_grid else np.zeros(time.size)
    rate, square = level_rate(time, speed, on_grid), mean_over_span(time, speed**2)
    reach = round(LONGEST / STEP)
    inside = np.arange(reach, time.size - reach)
    used = inside[(speed > SLOWEST)[inside]]
    if used.size * STEP < SHORTEST_DRIVE:
        return 0.0
    shifts = np.arange(-reach, reach + 1)
    left = np.array([_variance([torque[used - k], brake[used - k], square[used]], rate[used]) for k in shifts])
    best = int(np.argmin(left))
    evidence = 0.5 * used.size * STEP / LASTING * np.log(left[reach] / left[best])
    certain = evidence > VALIDATE_POLICY.delay_evidence
    late = abs(shifts[best]) * STEP >= VALIDATE_POLICY.least_delay and 0 < best < shifts.size - 1
    return float(shifts[best] * STEP) if certain and late else 0.0


def _variance(columns: Sequence[Array], y: Array) -> float:
    residual = ordinary_least_squares(np.column_stack([np.ones(y.size), *columns]), y)[1]
    return float(residual @ residual) / y.size


def _shifted(log: Log, delay: float) -> Log:
    """The log with its speed ``delay`` seconds earlier, by whole samples; without a value where none was read."""
    from scipy.ndimage import shift

    rows = round(delay / float(np.median(np.diff(log.time))))
    early = shift(log["speed"], -rows, order=0, cval=np.nan)
    samples = {n: s for n, s in log.samples.items() if n != "speed"}
    return replace(log, channels={**log.channels, "speed": early}, samples=samples)
