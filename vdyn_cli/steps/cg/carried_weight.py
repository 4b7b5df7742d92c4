"""The load of both axles over the speed: the weight minus the aerodynamic lift.

    Ff + Fr + Fl(V) = M g + M z''

The body's heave z is not measured, but bounded: over windows longer than its period its acceleration nearly averages
out. Each run has a free constant (zeros and gains of the loads, the mass), so that only changes with the speed and with
the acceleration (crosstalk of the longitudinal force) are compared.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import white_level
from vdyn_cli.inference.banded import factored, whitened
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.policy import CG_POLICY

LENGTH = 0.5  # s of a window: at least half a period of the body's heave of 1 to 2 Hz
LONGEST_GAP = 3.0  # usual steps of the clock


@dataclass(frozen=True)
class CarriedWeight:
    """Windows of one run over which the load of both axles is averaged.

    Parameters
    ----------
    samples : (k, m), indices of each window's samples. middle : (k,), s.
    factor : (2, k), banded Cholesky factor of the covariance of the windows' means, N^2.
    left_out : (k, 1), the run's free constant, whitened, of length 1.
    """

    samples: NDArray[np.int64]
    middle: Array
    factor: Array
    left_out: Array

    def rows(self, carried: Array) -> Array:
        """Whitened rows (k, 1 + j) of the residual and its derivatives.

        Parameters
        ----------
        carried : (n, 1 + j), N, load of both axles plus lift as corrected by the model, and its derivatives.
        """
        white = whitened(self.factor, carried[self.samples].mean(axis=1))
        return np.asarray(white - self.left_out @ (self.left_out.T @ white))


def carried_weight(log: Log, mass: float) -> CarriedWeight | None:
    """The windows of a run; None where a load or the speed is not logged, or too few windows are complete.

    Parameters
    ----------
    log : with front_load, rear_load (N), acceleration (m/s^2), speed (m/s).
    mass : kg.
    """
    if any(name not in log for name in ("front_load", "rear_load", "speed")):
        return None
    load, speed, push = log["front_load"] + log["rear_load"], log["speed"], log["acceleration"]
    step = float(np.median(np.diff(log.time)))
    length = max(round(LENGTH / step), 1)
    samples = np.arange(log.time.size // length * length).reshape(-1, length)
    whole = np.isfinite(load + speed + push)[samples].all(axis=1)
    whole &= log.time[samples[:, -1]] - log.time[samples[:, 0]] < (length + LONGEST_GAP) * step
    samples = samples[whole]
    if len(samples) < CG_POLICY.carried_windows:
        return None
    means = np.column_stack([np.ones(len(samples)), push[samples].mean(axis=1)])
    adjacent = np.diff(samples[:, 0]) == length
    heave = mass * _heave_speed(load[samples], speed[samples], means, step, mass) / (length * step)
    band = np.zeros((2, len(samples)))
    band[0] = white_level(load, log.time) ** 2 / length + 2 * heave**2
    band[1, :-1] = -(heave**2) * adjacent
    factor = factored(band)
    left_out = np.linalg.qr(whitened(factor, means[:, :1]))[0]
    return CarriedWeight(samples, log.time[samples].mean(axis=1), factor, left_out)


def _heave_speed(load: Array, speed: Array, means: Array, step: float, mass: float) -> float:
    """Standard deviation of the heave velocity at the windows' ends, m/s.

    M z' is the integral of the loads minus a constant and terms in the acceleration and the squared speed, without its
    linear trend.
    """
    columns = np.column_stack([means, (speed**2).mean(axis=1)])
    average = load.mean(axis=1)
    left = average - columns @ np.linalg.lstsq(columns, average, rcond=None)[0]
    gained = np.cumsum(left) * load.shape[1] * step / mass
    line = np.column_stack([np.ones(gained.size), np.arange(gained.size)])
    return float(np.std(gained - line @ np.linalg.lstsq(line, gained, rcond=None)[0]))
