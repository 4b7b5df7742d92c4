"""The logged speed as a second reading of the acceleration, and a zero that it shows in an acceleration.

    V(t) - mean V = integral of a - its mean + error

In the loads a tilt or a zero of the accelerometer is collinear with the position of the center of gravity; with a
logged speed it is a slope of V - integral of a over time. A delay between the channels, a gain of one of them, and the
antenna's motion with the pitch differ from such a slope; an error larger than the speed's noise covers them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.load_windows import pitch_angle
from vdyn_cli.steps.cg.policy import CG_POLICY

EVERY = 0.5  # s between the compared speeds: half a period of the body's pitch, which moves the antenna
FEWEST_SPEEDS = 8  # speeds of a run
LONGEST_GAP = 5.0  # usual steps of the clock
# m/s^2, standard deviation of the mean acceleration minus the mean rate of the speed in one run: 0.02 m/s^2 moves the
# center of gravity by a millimeter. It is distributed over the speeds of the run as white noise.
LEAST_SLOPE = 0.01
FEWEST_SAMPLES = 100  # of a run; a tenth of it is averaged at either end
DELAY = 0.1  # s, between the channels: a receiver filters the rate over a few of its samples


@dataclass(frozen=True)
class SpeedChange:
    """The logged speed of one run at some of its samples.

    Parameters
    ----------
    time : (n,), s, of all samples. at : (m,), indices of the speeds compared.
    speed : (m,), m/s, minus its mean. error : m/s, standard deviation of each.
    """

    time: Array
    at: NDArray[np.int64]
    speed: Array
    error: float

    def rows(self, rate: Array) -> Array:
        """Whitened rows (m, 1 + j) of the residual and its derivatives.

        Parameters
        ----------
        rate : (n, 1 + j), m/s^2, acceleration as corrected by the model, and its derivatives.
        """
        steps = np.diff(self.time)[:, None] * (rate[1:] + rate[:-1]) / 2
        gained = np.vstack([np.zeros(rate.shape[1]), np.cumsum(steps, axis=0)])[self.at]
        gained -= gained.mean(axis=0)
        gained[:, 0] -= self.speed
        return np.asarray(gained / self.error)


def speed_change(log: Log) -> SpeedChange | None:
    """The speed of a run, m/s; None where it is not logged, or acceleration or speed has gaps.

    Parameters
    ----------
    log : with speed (m/s), acceleration (m/s^2).
    """
    if "speed" not in log or not (np.isfinite(log["speed"]).all() and np.isfinite(log["acceleration"]).all()):
        return None
    time, speed = log.time, log["speed"]
    step = float(np.median(np.diff(time)))
    wanted = np.arange(time[0], time[-1], EVERY)
    at = np.unique(np.searchsorted(time, wanted)).astype(np.int64)
    if np.max(np.diff(time)) > LONGEST_GAP * step or at.size < FEWEST_SPEEDS:
        return None
    duration = float(time[at[-1]] - time[at[0]])
    error = LEAST_SLOPE * duration * (at.size / 12.0) ** 0.5  # a line through m points: std of slope (12 / m)^0.5 / T
    chosen = speed[at]
    return SpeedChange(time, at, chosen - chosen.mean(), max(white_level(speed, time), error))


def other_accelerometer(logs: Sequence[Log], stated: str) -> list[Finding]:
    """A finding where the acceleration follows the speed much better if its sensor is of the other kind than stated.

    With the pitch th, a sensor on the body reads a + g th, and an antenna a. The integral for the other kind must leave
    at most ``gravity_left`` of the squares that the one for the stated kind leaves. Both are without a line over time,
    which a zero of the acceleration adds.

    Parameters
    ----------
    logs : with acceleration as evaluated for the stated kind (m/s^2), thus for ``body`` without g th.
    stated : ``gps`` or ``body``.
    """
    rows = [one for log in logs if (one := _integrated(log)) is not None]
    if not rows:
        return []
    speed, gained, gravity = np.concatenate(rows).T
    on_body = stated == "body"
    other = gained + gravity if on_body else gained - gravity
    left, less = (float(np.sqrt(np.mean((speed - by) ** 2))) for by in (gained, other))
    if less**2 > CG_POLICY.gravity_left * left**2:
        return []
    share, seems = ("without", "that of an antenna") if on_body else ("with", "on the body")
    what = f"follows the speed better {share} gravity along the pitching body: the accelerometer seems to be {seems}"
    kind, place = ("gps", "it is") if on_body else ("body", "it is not")
    remedy = f"write 'settings: {{accelerometer: {kind}}}'; if {place} on the body, its gain is wrong"
    return [Finding("acceleration", what, f"{less:.2g} m/s rms instead of {left:.2g} m/s", remedy, doubt=True)]


def _integrated(log: Log) -> Array | None:
    """Speed, integral of the acceleration and of gravity along the body, (m, 3) m/s, each without a line over time."""
    change = speed_change(log)
    if change is None:
        return None
    rate = np.column_stack([log["acceleration"], GRAVITY * pitch_angle(log)])
    if not np.isfinite(rate).all():
        return None
    gained = change.error * change.rows(rate)
    made = np.column_stack([change.speed, gained[:, 0] + change.speed, gained[:, 1]])
    line = np.column_stack([np.ones(change.at.size), change.time[change.at] - change.time[change.at[0]]])
    return np.asarray(made - line @ np.linalg.lstsq(line, made, rcond=None)[0])


def gps_zero(logs: Sequence[Log]) -> list[Finding]:
    """A finding where the mean acceleration differs from the change of speed over time: a0 = mean(a) - (V1 - V0) / T.

    The mean of a0 over runs must exceed ``gps_zero_least`` and ``gps_zero_std`` standard deviations. The loads do not
    show such a zero, because it is collinear with the position of the center of gravity.

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
    if abs(mean) < max(CG_POLICY.gps_zero_least, CG_POLICY.gps_zero_std * float(np.hypot(noise, scatter))):
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
    time, speed, read = log.time[there], log["speed"][there], log["acceleration"][there]
    if np.max(np.diff(time)) > LONGEST_GAP * float(np.median(np.diff(time))):
        return None
    ends = slice(0, FEWEST_SAMPLES // 10), slice(-(FEWEST_SAMPLES // 10), None)
    (t0, t1), (v0, v1) = ([float(np.mean(x[end])) for end in ends] for x in (time, speed))
    changes = cumulative_integral(time, read)
    a0, a1 = np.interp([t0, t1], time, changes)
    noise = white_level(speed, time) * np.sqrt(2.0 / (FEWEST_SAMPLES // 10))
    late = DELAY * float(np.mean(read[ends[1]]) - np.mean(read[ends[0]]))
    return float(a1 - a0 - (v1 - v0)) / (t1 - t0), max(float(np.hypot(noise, late)) / (t1 - t0), 1e-9)
