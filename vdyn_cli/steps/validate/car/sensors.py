"""The compared channels, and readings of their sensors: gains are the same in all segments, zeros are not."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from vdyn_cli.engine.simulate import Simulated
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.complete_inputs import OUTPUTS
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.spec import ValidateSpec

GAINS = ("speed", "shaft_torque", "acceleration")
FARTHEST_GAIN = 0.5  # from a gain of one: bounds of the fit
FARTHEST_ZERO = 50.0  # standard deviations


@dataclass(frozen=True)
class Sensors:
    """Standard deviations of the sensors' unknown errors.

    Parameters
    ----------
    channels : outputs that are fitted.
    zeros : by channel (also drive_torque), standard deviation of the zero, which differs between segments.
    gains : by sensor, standard deviation of the gain, the same in all segments; both shaft torques share one.
    held : by channel whose values the logger held (also drive_torque), the time by which they may be late, s.
    """

    channels: tuple[str, ...]
    zeros: Mapping[str, float]
    gains: Mapping[str, float]
    held: Mapping[str, float] = field(default_factory=dict)

    @cached_property
    def with_zero(self) -> tuple[str, ...]:
        """Channels whose zero is a nuisance parameter of every segment; the drive torque, an input, comes first."""
        return tuple(n for n in ("drive_torque", *self.channels) if self.zeros.get(n, 0.0) > 0)

    @property
    def input_zeros(self) -> int:
        """Number of zeros that belong to an input: 1 for the drive torque, else 0."""
        return int("drive_torque" in self.with_zero)

    @cached_property
    def gain_std(self) -> dict[str, float]:
        """The gains that all segments share, by name of the unknown, with their standard deviations."""
        return {f"{n}_gain": self.gains[n] for n in GAINS if self.gains.get(n, 0.0) > 0 and self._reading(n)}

    def _reading(self, group: str) -> tuple[str, ...]:
        return tuple(n for n in self.channels if n.startswith(group))

    def read(self, name: str, true: Array, gains: Array, zeros: Array) -> tuple[Array, tuple[Array, Array]]:
        """The reading (n,) of a channel's sensor, and its derivatives to gains, (n, k), and zeros, (n, m).

        (1 + gain) true + zero, with the gain of the sensor and the zero of the channel, if these are unknown
        """
        to_gains, to_zeros = np.zeros((true.size, gains.size)), np.zeros((true.size, zeros.size))
        for i, instrument in enumerate(self.gain_std):
            if name in self._reading(instrument.removesuffix("_gain")):
                to_gains[:, i] = true
        if name in self.with_zero:
            to_zeros[:, self.with_zero.index(name) - self.input_zeros] = 1.0
        return true + to_gains @ gains + to_zeros @ zeros, (to_gains, to_zeros)

    def gain_unknowns(self) -> tuple[Unknown, ...]:
        """The relative gain errors as unknowns that all segments share."""
        return tuple(
            Unknown(n, 0.0, -FARTHEST_GAIN, FARTHEST_GAIN, "", (0.0, std), nuisance=True)
            for n, std in self.gain_std.items()
        )

    def zero_unknowns(self) -> tuple[Unknown, ...]:
        """The zeros as unknowns of each segment."""
        far = {n: FARTHEST_ZERO * self.zeros[n] for n in self.with_zero}
        return tuple(
            Unknown(f"{n}_zero", 0.0, -far[n], far[n], "", (0.0, self.zeros[n]), per_run=True, nuisance=True)
            for n in self.with_zero
        )


def ideal_readings(seen: Simulated) -> tuple[dict[str, Array], dict[str, Array]]:
    """Readings of perfect sensors in a simulated segment, (n,), and their derivatives to the unknowns, (n, k)."""
    names = [n for n in OUTPUTS if n in seen.outputs]
    return {n: seen.outputs[n] for n in names}, {n: seen.sensitivities[n] for n in names}


def has_two_motors(spec: ValidateSpec, logs: Sequence[Log]) -> bool:
    """Whether the full vehicle has a motor on each side: the torques of the half-shafts' inner ends are recorded.

    A drive_torque that is only their sum, added on reading, does not count as recorded.
    """
    if spec.settings.model != "vehicle" or not all("drive_torque_left" in log for log in logs):
        return False
    return "drive_torque" not in spec.mapped or not any("drive_torque" in log for log in logs)


def _varies(log: Log, channel: str) -> bool:
    """Whether a channel varies, or is missing: a constant reading would be mistaken for noise shared by all outputs."""
    values = log[channel] if channel in log else np.zeros(0)
    return not values.size or float(np.nanmax(values)) > float(np.nanmin(values))


def compared_sensors(
    spec: ValidateSpec, logs: Sequence[Log], segments: Sequence[DriveSegment], slope_sensed: bool
) -> Sensors:
    """The compared channels that model and logs have, with the standard deviations of their zeros and gains.

    Parameters
    ----------
    slope_sensed : whether the accelerometer gives the slope of the road; it is then an input.
    """
    s = spec.settings
    has = OUTPUTS if s.model == "vehicle" else ("speed",) if slope_sensed else ("speed", "acceleration")
    there = [n for n in has if all(n in one.outputs for one in segments)]
    channels = tuple(n for n in there if n == "speed" or all(_varies(log, n) for log in logs))
    zeros = dict.fromkeys(("shaft_torque_left", "shaft_torque_right"), s.zeros.shaft_torque.value)
    zeros["acceleration"] = s.zeros.acceleration.value
    if s.model == "vehicle":  # in a mass on a road it would act like a free force in every drive
        zeros["drive_torque"] = s.zeros.drive_torque.value
    gains = {n: getattr(s.gains, n).value for n in ("speed", "shaft_torque", "acceleration")}
    held = {n: max(log.held.get(n, 0.0) for log in logs) for n in {n for log in logs for n in log.held}}
    return Sensors(channels, zeros, gains, held)
