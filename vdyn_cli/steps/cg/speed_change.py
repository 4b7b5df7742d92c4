"""The logged speed as a second reading of the acceleration.

    V(t) - mean V = integral of a - its mean + error

In the loads a tilt or a zero of the accelerometer is collinear with the position of the center of gravity; with a
logged speed it is a slope of V - integral of a over time. A delay between the channels, a gain of one of them, and the
antenna's motion with the pitch differ from such a slope; an error larger than the speed's noise covers them.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log

EVERY = 0.5  # s between the compared speeds: half a period of the body's pitch, which moves the antenna
FEWEST = 8  # speeds of a run
LONGEST_GAP = 5.0  # usual steps of the clock
# m/s^2, standard deviation of the mean acceleration minus the mean rate of the speed in one run: 0.02 m/s^2 moves the
# center of gravity by a millimeter. It is distributed over the speeds of the run as white noise.
LEAST_SLOPE = 0.01


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
    if np.max(np.diff(time)) > LONGEST_GAP * step or at.size < FEWEST:
        return None
    duration = float(time[at[-1]] - time[at[0]])
    error = LEAST_SLOPE * duration * (at.size / 12.0) ** 0.5  # a line through m points: std of slope (12 / m)^0.5 / T
    chosen = speed[at]
    return SpeedChange(time, at, chosen - chosen.mean(), max(white_level(speed, time), error))
