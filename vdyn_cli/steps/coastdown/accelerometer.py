"""An accelerometer's zero from the energy of a whole drive.

A forward accelerometer feels f = V' + g sin(grade) + zero. Times the speed, over a whole log::

    int f V dt = (V_end^2 - V_start^2)/2 + g (height gained) + zero x distance

so the zero is known as well as the net climb: from an elevation channel, or because roads lead up as often as
down. Standstill is no help: a car stops on slopes.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log

LONGEST_GAP = 1.0  # s between samples that still count as neighbours
SHORTEST = 500.0  # m that tell a zero


@dataclass(frozen=True)
class Zero:
    """m/s^2 with its standard deviation, and whether the elevation channel was of use."""

    value: float
    std: float
    by_elevation: bool


def zero_of(log: Log, elevation_error: float, mean_slope: float) -> Zero:
    """The zero in one log.

    Parameters
    ----------
    log : channels speed, acceleration and perhaps elevation (m).
    elevation_error : m, standard deviation of the elevation at either end.
    mean_slope : standard deviation of a road's net slope, used where there is no elevation or it stands still.
    """
    names = [n for n in ("speed", "acceleration", "elevation") if n in log]
    good = np.all([np.isfinite(log[n]) for n in names if n != "elevation"], axis=0)
    time, speed, force = log.time[good], log["speed"][good], log["acceleration"][good]
    step = np.diff(time)
    joined = step < LONGEST_GAP
    pace = 0.5 * (speed[1:] + speed[:-1])
    distance = float(np.sum((pace * step)[joined]))
    if distance < SHORTEST:
        return Zero(0.0, GRAVITY * 0.02, False)
    felt = float(np.sum((0.5 * (force[1:] + force[:-1]) * pace * step)[joined]))
    gained = float(np.sum((0.5 * (speed[1:] ** 2 - speed[:-1] ** 2))[joined]))
    height = log["elevation"][np.isfinite(log["elevation"])] if "elevation" in log else np.zeros(1)
    measured = height.size > 0 and float(np.ptp(height)) > 0
    climb = float(height[-1] - height[0]) if measured else 0.0
    error = float(np.sqrt(2.0)) * elevation_error / distance if measured else mean_slope
    return Zero((felt - gained - GRAVITY * climb) / distance, GRAVITY * error, measured)
