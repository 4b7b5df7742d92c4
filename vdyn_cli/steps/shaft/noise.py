"""Noise in every channel of a half-shaft's log: conditions on the readings, and readings adjusted to fulfill them.

With A the derivative of the conditions g by the readings x and S the readings' covariance, x - S A' (A S A')^-1 g are
the most probable readings that fulfill the linearized conditions (Gauss-Helmert model).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.shaft.motor_acceleration import autocovariance, by_speed
from vdyn_cli.steps.shaft.shaft_readings import ShaftReadings

GAP = 3.0  # median time steps; over longer ones the twist is not integrated
UNCHAINED = 1.0  # rad^2, variance of the twist's change over a gap, which is unknown


@dataclass(frozen=True)
class ReadingConditions:
    """The conditions on one run's readings, linearized.

    Parameters
    ----------
    values : (2 n - 1,), alternately the residual of the torque (N m) and of the twist's integration (rad).
    to_twist, to_rate : (n,), derivatives of the law's torque by twist and rate, N m/rad and N m s/rad.
    to_acceleration : likewise by the motor's acceleration, kg m^2, one value. The rows' covariance
        takes the noises of the motor's speed and of the rate as independent; the adjustment does not.
    """

    run: ShaftReadings
    values: Array
    to_twist: Array
    to_rate: Array
    to_acceleration: float = 0.0

    @cached_property
    def factor(self) -> Array:
        """Banded Cholesky factor, (2 nodes - 1 or more, 2 n - 1), of the conditions' covariance A S A'."""
        torque, twist, rate = (noise**2 for noise in self.run.noise)
        to_twist, to_rate = self.run.chain
        width = len(self.run.nodes)
        band = np.zeros((2 * width - 1, self.values.size))
        band[0, ::2] = torque + self.to_twist**2 * twist + self.to_rate**2 * rate
        band[0, 1::2] = twist * np.sum(to_twist**2, axis=1) + rate * np.sum(to_rate**2, axis=1) + self._unchained
        condition = np.arange(len(to_twist))
        for k, nodes in enumerate(self.run.nodes):  # covariance of an integration condition with a sample's torque
            shared = twist * to_twist[:, k] * self.to_twist[nodes] + rate * to_rate[:, k] * self.to_rate[nodes]
            weighted = (to_twist[:, k] != 0) | (to_rate[:, k] != 0)
            first = np.minimum(2 * condition + 1, 2 * nodes)[weighted]
            band[np.abs(2 * condition + 1 - 2 * nodes)[weighted], first] = shared[weighted]
        for apart in range(1, width):
            shared = sum(
                noise * np.sum(w[:-apart, apart:] * w[apart:, : width - apart], axis=1)
                for noise, w in ((twist, to_twist), (rate, to_rate))
            )
            band[2 * apart, 1 : -2 * apart : 2] = shared
        if self.to_acceleration:
            moved = self.to_acceleration**2 * autocovariance(self.run.time, self.run.motor_noise)
            wider = np.zeros((max(len(band), 2 * moved.size - 1), band.shape[1]))
            wider[: len(band)] = band
            band = wider
            for apart, covariance in enumerate(moved):
                band[2 * apart, : band.shape[1] - 2 * apart : 2] += covariance
        return factored(band)

    @property
    def _unchained(self) -> Array:
        """Variance added to each integration condition, rad^2: that of a gap has no weight."""
        step = np.diff(self.run.time)
        broken = step > GAP * np.median(step)
        if self.run.rate_unread:
            broken[1:] |= broken[:-1].copy()
        return np.where(broken, UNCHAINED, 0.0)

    def adjusted(self) -> tuple[Array, Array, Array]:
        """The most probable twist (rad), rate and motor speed (rad/s), (n,) each, by the module's equation.

        The rate is that of motor and wheel: what moves it moves the motor's speed.
        """
        weights = weighed(self.factor, whitened(self.factor, self.values))
        pulls = []
        for slope, link in zip((self.to_twist, self.to_rate), self.run.chain, strict=True):
            pull = slope * weights[::2]
            for k, nodes in enumerate(self.run.nodes):
                np.add.at(pull, nodes, link[:, k] * weights[1::2])
            pulls.append(pull)
        _, twist_noise, rate_noise = self.run.noise
        motor = self.run.motor_speed
        if motor.size:
            moved = pulls[1] + self.to_acceleration * by_speed(self.run.time, weights[::2])
            motor = motor - self.run.motor_noise**2 * moved
        return self.run.twist - twist_noise**2 * pulls[0], self.run.rate - rate_noise**2 * pulls[1], motor
