"""The unknowns of a segment's simulation: parameters with their prior, sensor errors, effects, and its own start."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.car.prior import ParameterPrior, prior_unknowns
from vdyn_cli.steps.validate.car.sensors import Sensors

START = "start.speed"
TORQUE_ZERO = "drive_torque_zero"
REST = 0.3  # m/s, below which a drive begins at rest
AT_REST = 1e-3  # m/s, standard deviation of the speed of a car at rest


@dataclass(frozen=True, eq=False)
class UnknownVector:
    """The order, the start values and the priors of all unknowns.

    A segment's vector is ``[parameters | gains of sensors | effects | start speed | zeros of sensors]``; the first
    three are shared by all segments.

    Parameters
    ----------
    prior : of the parameters. sensors : with unknown gains and zeros. added : unknowns of the effects.
    at : start values of parameters that do not start at their prior mean.
    torque_zeros : N m, start value of the drive torque's zero in each segment; empty: 0.
    measured_starts : (value, standard deviation) of each segment's measured start speed, m/s.
    start_speeds : m/s, start speed of each segment's simulation; empty: as measured.
    """

    prior: ParameterPrior
    sensors: Sensors
    added: tuple[Unknown, ...]
    at: Mapping[str, float]
    torque_zeros: tuple[float, ...]
    measured_starts: tuple[tuple[float, float], ...]
    start_speeds: tuple[float, ...] = ()

    @property
    def shared(self) -> tuple[str, ...]:
        """Names of the unknowns that all segments share."""
        return (*self.prior.names, *self.sensors.gain_std, *(u.name for u in self.added))

    @property
    def own(self) -> tuple[str, ...]:
        """Names of a segment's own unknowns."""
        return (START, *(f"{name}_zero" for name in self.sensors.with_zero))

    @property
    def torque_zero_place(self) -> int:
        """Index of the drive torque's zero in a segment's vector.

        Raises
        ------
        ValueError : the drive torque has no unknown zero.
        """
        return len(self.shared) + self.own.index(TORQUE_ZERO)

    @cached_property
    def simulated(self) -> NDArray[np.int64]:
        """Indices of the unknowns of the simulator; gains and zeros of outputs are applied afterwards."""
        k, m = len(self.prior.names), len(self.sensors.gain_std)
        end = len(self.shared) + 1 + self.sensors.input_zeros
        return np.concatenate([np.arange(k), np.arange(k + m, end)]).astype(np.int64)

    @property
    def theta(self) -> Array:
        """Start values (shared,) of the shared unknowns."""
        parameters = [self.at.get(n, self.prior.values[n]) for n in self.prior.names]
        return np.array([*parameters, *np.zeros(len(self.sensors.gain_std)), *(u.start for u in self.added)])

    def start(self, segment: int) -> Array:
        """Start values (shared + own,) of a segment's vector."""
        local = np.array([*self.theta, self.first_speed(segment), *np.zeros(len(self.sensors.with_zero))])
        if self.torque_zeros:
            local[self.torque_zero_place] = self.torque_zeros[segment]
        return local

    def first_speed(self, segment: int) -> float:
        """Speed with which the simulation of a segment starts, m/s."""
        return self.start_speeds[segment] if self.start_speeds else self.start_speed(segment)[0]

    def start_speed(self, segment: int) -> tuple[float, float]:
        """Measured start speed of a segment and its standard deviation, m/s; exactly zero for a car at rest."""
        value, std = self.measured_starts[segment]
        return (0.0, AT_REST) if abs(value) < REST and std < REST else (value, max(std, 1e-3))

    def unknowns(self) -> tuple[tuple[Unknown, ...], dict[str, Array]]:
        """All unknowns with their priors, and by name the start values (segments,) of each segment's own."""
        parameters = [replace(u, start=self.at.get(u.name, u.start)) for u in prior_unknowns(self.prior)]
        start = Unknown(START, 0.0, -10.0, 160.0, "m/s", per_run=True, nuisance=True)
        own = {START: np.array([self.first_speed(k) for k in range(len(self.measured_starts))])}
        if self.torque_zeros:
            own[TORQUE_ZERO] = np.array(self.torque_zeros)
        sensors = self.sensors
        return (*parameters, *sensors.gain_unknowns(), *self.added, start, *sensors.zero_unknowns()), own
