"""Does an acceleration that was made of the antenna's speed have a zero? The speed itself tells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.errors import Finding
from vdyn_cli.fit.noise import white_level
from vdyn_cli.log import Log

LEAST = 0.02  # m/s^2, which moves the centre of gravity by about a millimetre
SURE = 5.0  # standard deviations, by the runs' scatter and the speed's noise
FEWEST = 100  # samples


def gps_zero(logs: Sequence[Log]) -> list[Finding]:
    """A doubt where the mean acceleration is not the change of speed over time: a0 = mean(a) - (V1 - V0) / T.

    Of such a zero the loads say nothing: another place of the centre of gravity looks alike.

    Parameters
    ----------
    logs : with acceleration as the rate of the speed (m/s^2); those without speed (m/s) say nothing.
    """
    found = [_zero(log) for log in logs if "speed" in log]
    zeros = np.array([one for one in found if one is not None])
    if not zeros.size:
        return []
    mean, noise = float(np.average(zeros[:, 0], weights=zeros[:, 1] ** -2)), float(np.sum(zeros[:, 1] ** -2) ** -0.5)
    scatter = float(np.std(zeros[:, 0], ddof=1)) / np.sqrt(len(zeros)) if len(zeros) > 1 else 0.0
    if abs(mean) < max(LEAST, SURE * float(np.hypot(noise, scatter))):
        return []
    what = f"acceleration reads {mean:+.3f} m/s^2 more than the speed's own rate: cg_to_front is off by that"
    remedy = "take its zero out, or map the speed's rate; of a sensor in the body write 'accelerometer: body'"
    return [Finding(f"{len(zeros)} runs" if len(zeros) > 1 else logs[0].name, what, "", remedy, doubt=True)]


def _zero(log: Log) -> tuple[float, float] | None:
    """m/s^2, and its standard deviation by the noise of the speed at both ends."""
    there = np.isfinite(log["acceleration"]) & np.isfinite(log["speed"])
    if np.count_nonzero(there) < FEWEST:
        return None
    time, speed, felt = log.time[there], log["speed"][there], log["acceleration"][there]
    ends = slice(0, FEWEST // 10), slice(-(FEWEST // 10), None)
    (t0, t1), (v0, v1) = ([float(np.mean(x[end])) for end in ends] for x in (time, speed))
    changes = np.concatenate([[0.0], np.cumsum(np.diff(time) * (felt[1:] + felt[:-1]) / 2)])
    a0, a1 = np.interp([t0, t1], time, changes)
    noise = white_level(speed, time) * np.sqrt(2.0 / (FEWEST // 10))
    return float(a1 - a0 - (v1 - v0)) / (t1 - t0), max(float(noise) / (t1 - t0), 1e-9)
