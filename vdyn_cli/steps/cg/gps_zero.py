"""The zero offset of an acceleration that a receiver derives from the antenna's speed, estimated from that speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.white_noise import white_level
from vdyn_cli.quantities.arrays import cumulative_integral
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_policy import STEP_POLICY

FEWEST_SAMPLES = 100  # of a run; a tenth of it is averaged at either end
LONGEST_GAP = 5.0  # usual steps of the clock
DELAY = 0.1  # s, between the channels: a receiver filters the rate over a few of its samples


def gps_zero(logs: Sequence[Log]) -> list[Finding]:
    """A finding where the mean acceleration differs from the change of speed over time: a0 = mean(a) - (V1 - V0) / T.

    The loads do not show such a zero, because it is collinear with the position of the center of gravity.

    Parameters
    ----------
    logs : with acceleration as the rate of the speed (m/s^2); those without speed (m/s) are skipped.
    """
    found = {log.name: zero for log in logs if "speed" in log and (zero := _zero(log)) is not None}
    if not found:
        return []
    zeros = np.array(list(found.values()))
    mean, noise = float(np.average(zeros[:, 0], weights=zeros[:, 1] ** -2)), float(np.sum(zeros[:, 1] ** -2) ** -0.5)
    scatter = float(np.std(zeros[:, 0], ddof=1)) / np.sqrt(len(zeros)) if len(zeros) > 1 else 0.0
    if abs(mean) < max(STEP_POLICY.gps_zero_least, STEP_POLICY.gps_zero_std * float(np.hypot(noise, scatter))):
        return []
    what = f"acceleration reads {mean:+.3f} m/s^2 more than the rate of the speed, which biases the center of gravity"
    remedy = "subtract its zero offset, or map the speed's rate; for a sensor in the body write 'accelerometer: body'"
    return [Finding(f"{len(found)} runs" if len(found) > 1 else next(iter(found)), what, "", remedy, doubt=True)]


def _zero(log: Log) -> tuple[float, float] | None:
    """The zero, m/s^2, and its standard deviation by the speed's noise at both ends and a delay between the channels.

    None for a run that is too short or has gaps, in which the acceleration is unknown.
    """
    there = np.isfinite(log["acceleration"]) & np.isfinite(log["speed"])
    if np.count_nonzero(there) < FEWEST_SAMPLES:
        return None
    time, speed, felt = log.time[there], log["speed"][there], log["acceleration"][there]
    if np.max(np.diff(time)) > LONGEST_GAP * float(np.median(np.diff(time))):
        return None
    ends = slice(0, FEWEST_SAMPLES // 10), slice(-(FEWEST_SAMPLES // 10), None)
    (t0, t1), (v0, v1) = ([float(np.mean(x[end])) for end in ends] for x in (time, speed))
    changes = cumulative_integral(time, felt)
    a0, a1 = np.interp([t0, t1], time, changes)
    noise = white_level(speed, time) * np.sqrt(2.0 / (FEWEST_SAMPLES // 10))
    late = DELAY * float(np.mean(felt[ends[1]]) - np.mean(felt[ends[0]]))
    return float(a1 - a0 - (v1 - v0)) / (t1 - t0), max(float(np.hypot(noise, late)) / (t1 - t0), 1e-9)
