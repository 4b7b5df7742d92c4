"""Noise of the impulses in the windows of a drive, from the noise of torque, acceleration and wheel speed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.banded import factored
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class WindowNoise:
    """Noise of one run's windows. Torque and acceleration are integrated over a window by the trapezoidal rule.

    Parameters
    ----------
    torque, acceleration, speed : standard deviations of a sample of the net torque (N m), of the accelerometer (m/s^2)
        and of the wheel's speed (rad/s).
    reading : standard deviation of a sample of the hub's torque alone, N m.
    squares : (w,), s^2, sum of squares of the samples' weights in each window's integral.
    shared : (w - 1,), s^2, product of the two weights of the sample that adjacent windows share; 0 where a gap
        separates them.
    slow : (w,), (m/s)^2, variance of the accelerometer's integral by errors that last longer than a sample.
    """

    torque: float
    acceleration: float
    speed: float
    reading: float
    squares: Array
    shared: Array
    slow: Array

    def variance(self, inertia: float, moment: float, lag: float = 0.0) -> Array:
        """Variance of each window's impulse, (w,) (N m s)^2, by torque, acceleration and two readings of the speed.

        Parameters
        ----------
        As of :meth:`factor`.
        """
        of_forces = self._sampled(moment) * self.squares + moment**2 * self.slow
        return np.asarray(of_forces + 2.0 * self._at_edge(inertia, lag))

    def _at_edge(self, inertia: float, lag: float) -> float:
        """Variance of an impulse, (N m s)^2, by the readings at one edge of its window."""
        return (inertia * self.speed) ** 2 + (lag * self.reading) ** 2

    def _sampled(self, moment: float) -> float:
        """Variance of a sample of torque and acceleration together, (N m)^2."""
        return self.torque**2 + (moment * self.acceleration) ** 2

    def factor(self, inertia: float, moment: float, lag: float = 0.0) -> Array:
        """Banded Cholesky factor, (2, w), of the covariance of the windows' impulses, (N m s)^2.

        Adjacent windows share one sample. The error of its speed has opposite signs in them, the errors of its torque
        and acceleration the same sign. A torque whose low-pass filter is corrected adds ``lag`` times the change of its
        reading over the window to the impulse, with the noise of the two readings.

        Parameters
        ----------
        inertia : kg m^2. moment : kg m, mass times radius of the wheel, the factor of the acceleration. lag : s, time
            constant of the filter that is corrected.
        """
        band = np.zeros((2, self.squares.size))
        band[0] = self.variance(inertia, moment, lag)
        of_sample = self._sampled(moment) * self.shared - self._at_edge(inertia, lag)
        band[1, :-1] = np.where(self.shared > 0.0, of_sample, 0.0)
        return factored(band)

    def speed_covariance(self, vector: Array) -> Array:
        """Covariance of the speeds gained, (rad/s)^2, times a vector, both (w,)."""
        return self.speed**2 * self._changes(vector)

    def reading_covariance(self, vector: Array) -> Array:
        """Covariance of the changes of the torque's reading, (N m)^2, times a vector, both (w,)."""
        return self.reading**2 * self._changes(vector)

    def _changes(self, vector: Array) -> Array:
        """Covariance of the changes over the windows of a signal with unit white noise, times a vector, both (w,)."""
        adjoining = self.shared > 0.0
        total = 2 * vector
        total[:-1] -= adjoining * vector[1:]
        total[1:] -= adjoining * vector[:-1]
        return np.asarray(total)

    def acceleration_covariance(self, vector: Array) -> Array:
        """Covariance of the accelerometer's integrals, (m/s)^2, times a vector, both (w,)."""
        total = self.squares * vector
        total[:-1] += self.shared * vector[1:]
        total[1:] += self.shared * vector[:-1]
        return np.asarray(self.acceleration**2 * total + self.slow * vector)
