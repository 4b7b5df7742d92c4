"""Noise of the impulses in the windows of a drive, from the noise of torque, acceleration and wheel speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.banded import factored
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class WindowNoise:
    """Noise of one run's windows.

    Parameters
    ----------
    torque, speed : standard deviations of a sample of the net torque (N m) and of the wheel's speed (rad/s).
    spread : (w,), s, root of the sum of squares of the samples' weights in each window's integral.
    carried : (w,), (m/s)^2, variance of the accelerometer's integral over each window.
    adjoining : (w - 1,), whether a window's last sample is the next one's first.
    """

    torque: float
    speed: float
    spread: Array
    carried: Array
    adjoining: NDArray[np.bool_]

    def variance(self, inertia: float, moment: float) -> Array:
        """Variance of each window's impulse, (w,) (N m s)^2, by torque, acceleration and two readings of the speed.

        Parameters
        ----------
        inertia : kg m^2. moment : kg m, mass times radius of the wheel, the factor of the acceleration.
        """
        of_torque = (self.torque * self.spread) ** 2 + moment**2 * self.carried
        return np.asarray(of_torque + 2.0 * (inertia * self.speed) ** 2)

    def factor(self, inertia: float, moment: float) -> Array:
        """Banded Cholesky factor, (2, w), of the covariance of the windows' impulses, (N m s)^2.

        Adjacent windows share one reading of the speed, whose error has opposite signs in them.

        Parameters
        ----------
        inertia : kg m^2. moment : kg m, mass times radius of the wheel, the factor of the acceleration.
        """
        band = np.zeros((2, self.spread.size))
        band[0] = self.variance(inertia, moment)
        band[1, :-1] = np.where(self.adjoining, -((inertia * self.speed) ** 2), 0.0)
        return factored(band)

    def speed_covariance(self, vector: Array) -> Array:
        """Covariance of the speeds gained, (rad/s)^2, times a vector, both (w,)."""
        total = 2 * vector
        total[:-1] -= self.adjoining * vector[1:]
        total[1:] -= self.adjoining * vector[:-1]
        return np.asarray(self.speed**2 * total)
