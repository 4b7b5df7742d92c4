"""The channels of a validation's logs that are compared with the simulation, and the torques that drive it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.car.sensors import Sensors
from vdyn_cli.steps.validate.drives.complete_inputs import OUTPUTS
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.spec import ValidateSpec


def has_two_motors(spec: ValidateSpec, logs: Sequence[Log]) -> bool:
    """Whether the full vehicle has a motor on each side: the torques of the half-shafts' inner ends are recorded.

    A drive_torque that is only their sum, added on reading, does not count as recorded.
    """
    if spec.settings.model != "vehicle" or not all("drive_torque_left" in log for log in logs):
        return False
    loggers = [one.channels for one in spec.loggers] if spec.loggers else [spec.channels]
    mapped = {name for channels in loggers for name in channels}
    return "drive_torque" not in mapped or not any("drive_torque" in log for log in logs)


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
