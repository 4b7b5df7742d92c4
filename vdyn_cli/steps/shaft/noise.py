"""Noise in every channel of a half-shaft's log: the conditions on the readings, and readings adjusted to fulfil them.

With A the derivative of the conditions g to the readings x and S the readings' covariance, x - S A' (A S A')^-1 g are
the nearest readings, by their noise, that fulfil the linearized conditions (Gauss-Helmert model).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings

GAP = 3.0  # of the median time step; longer ones break the chain
UNCHAINED = 1.0  # rad^2, variance of the twist's change over a gap: nothing is known of it


@dataclass(frozen=True)
class ReadingConditions:
    """The conditions on one run's readings, linearized.

    Parameters
    ----------
    values : (2 n - 1,), torque less the law's (N m) and twist less the integral of its rate (rad) in turn.
    to_twist, to_rate : (n,), slopes of the law's torque, N m/rad and N m s/rad.
    """

    run: ShaftReadings
    values: Array
    to_twist: Array
    to_rate: Array

    @cached_property
    def factor(self) -> Array:
        """Banded Cholesky factor, (3, 2 n - 1), of the conditions' covariance A S A'."""
        torque, twist, rate = (noise**2 for noise in self.run.noise)
        step = np.diff(self.run.time)
        half = step / 2
        band = np.zeros((3, self.values.size))
        band[0, ::2] = torque + self.to_twist**2 * twist + self.to_rate**2 * rate
        unchained = np.where(step > GAP * np.median(step), UNCHAINED, 0.0)
        band[0, 1::2] = 2 * twist + 2 * half**2 * rate + unchained
        band[1, :-1:2] = -self.to_twist[:-1] * twist - self.to_rate[:-1] * half * rate
        band[1, 1::2] = self.to_twist[1:] * twist - self.to_rate[1:] * half * rate
        band[2, 1:-2:2] = -twist + half[:-1] * half[1:] * rate
        return factored(band)

    def adjusted(self) -> tuple[Array, Array]:
        """Twist (rad) and rate (rad/s), (n,) each, nearest to the readings that fulfil the conditions."""
        weights = weighed(self.factor, whitened(self.factor, self.values))
        torque, chain = weights[::2], np.concatenate([[0.0], weights[1::2], [0.0]])
        half = np.concatenate([[0.0], np.diff(self.run.time) / 2, [0.0]])
        _, twist_noise, rate_noise = self.run.noise
        twist = self.run.twist - twist_noise**2 * (self.to_twist * torque + chain[:-1] - chain[1:])
        pulled = half[:-1] * chain[:-1] + half[1:] * chain[1:]
        return twist, self.run.rate - rate_noise**2 * (self.to_rate * torque - pulled)
