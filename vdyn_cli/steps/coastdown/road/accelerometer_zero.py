"""The zero offset of an accelerometer from the energy balance of a whole drive.

A forward accelerometer measures f = V' + g sin(grade) + zero. Times the speed, over a whole log::

    int f V dt = (V_end^2 - V_start^2)/2 + g (height gained) + zero x distance

so the zero is as accurate as the net climb, which comes from an elevation channel or from the assumption that the mean
slope of all roads is zero. A reading at standstill does not give the zero, because the car may stand on a slope.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log

LONGEST_GAP = 1.0  # s between samples that still count as neighbors
SHORTEST_ROAD = 500.0  # m: below, 5 m of elevation error come near UNKNOWN_STD
UNKNOWN_STD = 0.02 * GRAVITY  # m/s^2, of a zero that is not measured: a grade of 2 % or a body pitch of one degree


@dataclass(frozen=True)
class AccelerometerZero:
    """Value and standard deviation, m/s^2, and whether the climb was taken from the elevation channel."""

    value: float
    std: float
    by_elevation: bool


def zero_of(log: Log, elevation_error: float, mean_slope: float) -> AccelerometerZero:
    """The accelerometer's zero in one log, by the module's energy balance.

    Gaps longer than a second are left out. A log shorter than ``SHORTEST_ROAD`` m has the zero 0 +- ``UNKNOWN_STD``.

    Parameters
    ----------
    log : channels speed (m/s), acceleration (specific force, m/s^2) and perhaps elevation (m).
    elevation_error : m, standard deviation of the elevation at either end.
    mean_slope : standard deviation of a road's net slope, used where no elevation is logged or it is constant.
    """
    names = [n for n in ("speed", "acceleration", "elevation") if n in log]
    good = np.all([np.isfinite(log[n]) for n in names if n != "elevation"], axis=0)
    time, speed, force = log.time[good], log["speed"][good], log["acceleration"][good]
    step = np.diff(time)
    joined = step < LONGEST_GAP
    pace = 0.5 * (speed[1:] + speed[:-1])
    distance = float(np.sum((pace * step)[joined]))
    if distance < SHORTEST_ROAD:
        return AccelerometerZero(0.0, UNKNOWN_STD, False)
    work = float(np.sum((0.5 * (force[1:] + force[:-1]) * pace * step)[joined]))
    gained = float(np.sum((0.5 * (speed[1:] ** 2 - speed[:-1] ** 2))[joined]))
    known = np.isfinite(log["elevation"]) if "elevation" in log else np.zeros(log.time.size, dtype=bool)
    measured = bool(known.any()) and float(np.ptp(log["elevation"][known])) > 0
    height = np.interp(time, log.time[known], log["elevation"][known]) if measured else np.zeros(time.size)
    climb = float(np.sum(np.diff(height)[joined]))  # the work done in a gap is not known
    ends = np.sqrt(2.0 * (1 + np.count_nonzero(~joined)))
    error = float(ends) * elevation_error / distance if measured else mean_slope
    return AccelerometerZero((work - gained - GRAVITY * climb) / distance, GRAVITY * error, measured)
