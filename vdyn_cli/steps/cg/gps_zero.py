"""Does an acceleration that was made of the antenna's speed have a zero? The speed itself tells."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.white_noise import white_level
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

LEAST = 0.02  # m/s^2, which moves the centre of gravity by about a millimetre
SURE = 5.0  # standard deviations, by the runs' scatter and the speed's noise
FEWEST = 100  # samples
GAP = 5.0  # usual steps of the clock
DELAY = 0.1  # s, that one channel may come later than the other


def gps_zero(logs: Sequence[Log]) -> list[Finding]:
    """A doubt where the mean acceleration is not the change of speed over time: a0 = mean(a) - (V1 - V0) / T.

    Of such a zero the loads say nothing: another place of the centre of gravity looks alike.

    Parameters
    ----------
    logs : with acceleration as the rate of the speed (m/s^2); those without speed (m/s) say nothing.
    """
    found = {log.name: one for log in logs if "speed" in log and (one := _zero(log)) is not None}
    if not found:
        return []
    zeros = np.array(list(found.values()))
    mean, noise = float(np.average(zeros[:, 0], weights=zeros[:, 1] ** -2)), float(np.sum(zeros[:, 1] ** -2) ** -0.5)
    scatter = float(np.std(zeros[:, 0], ddof=1)) / np.sqrt(len(zeros)) if len(zeros) > 1 else 0.0
    if abs(mean) < max(LEAST, SURE * float(np.hypot(noise, scatter))):
        return []
    what = f"acceleration reads {mean:+.3f} m/s^2 more than the speed's own rate: that misplaces the centre of gravity"
    remedy = "take its zero out, or map the speed's rate; of a sensor in the body write 'accelerometer: body'"
    return [Finding(f"{len(found)} runs" if len(found) > 1 else next(iter(found)), what, "", remedy, doubt=True)]


def _zero(log: Log) -> tuple[float, float] | None:
    """m/s^2, and its standard deviation by the noise of the speed at both ends and a delay between the two.

    None of a run with gaps, over which nothing is known of the acceleration.
    """
    there = np.isfinite(log["acceleration"]) & np.isfinite(log["speed"])
    if np.count_nonzero(there) < FEWEST:
        return None
    time, speed, felt = log.time[there], log["speed"][there], log["acceleration"][there]
    if np.max(np.diff(time)) > GAP * float(np.median(np.diff(time))):
        return None
    ends = slice(0, FEWEST // 10), slice(-(FEWEST // 10), None)
    (t0, t1), (v0, v1) = ([float(np.mean(x[end])) for end in ends] for x in (time, speed))
    changes = np.concatenate([[0.0], np.cumsum(np.diff(time) * (felt[1:] + felt[:-1]) / 2)])
    a0, a1 = np.interp([t0, t1], time, changes)
    noise = white_level(speed, time) * np.sqrt(2.0 / (FEWEST // 10))
    late = DELAY * float(np.mean(felt[ends[1]]) - np.mean(felt[ends[0]]))
    return float(a1 - a0 - (v1 - v0)) / (t1 - t0), max(float(np.hypot(noise, late)) / (t1 - t0), 1e-9)
