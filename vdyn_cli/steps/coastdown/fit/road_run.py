"""One run of a coast-down campaign as the fit uses it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array, cumulative_integral

LOWEST_LEVEL = 1e-4  # in SI, least white noise of a channel, because a simulated log has none
# m/s, error of the speed at which a timer records a split time: loggers state it to 0.1 km/h. The fit scales it to
# the residuals (gust_covariance: speed_noise).
SPLIT_LEVEL = 0.028


@dataclass(frozen=True)
class RoadRun:
    """One run as the fit uses it.

    Parameters
    ----------
    time, speed : (n,) s, m/s; finite.
    inputs : grade, wind_speed, and the drive's torque or force: (n,) each, or one number.
    part : (n,), label of the window of each row.
    acceleration : (n,) m/s^2 specific force, NaN where missing; its zero is already subtracted where ``zero_std`` (the
        standard deviation of that zero, m/s^2) is positive.
    heading : +1 out, -1 back, 0 unknown. start : s since the first run began. temperature : K.
    air_density : kg/m^3 of this run; None: that of the campaign.
    since : s from the beginning of the log to the first row.
    before : m, driven before the first row, since the first fitted part of the log began.
    place : m, road coordinate at the first row; None where it is unknown.
    split : whether the log is a table of split times, whose rows are too sparse to show the noise of the speed.
    origin : index of the driven run of which this one is a part.
    slope_error : (n, r), factor of the covariance of the error of the grade; None where no error is known.
    changed : whether the car was changed in this run (run_change.changed_in); None: no change was found in any.
    """

    name: str
    time: Array
    speed: Array
    inputs: Mapping[str, Array | float]
    part: NDArray[np.int64]
    acceleration: Array | None = None
    zero_std: float = 0.0
    heading: float = 0.0
    start: float = 0.0
    temperature: float = 293.15
    air_density: float | None = None
    since: float = 0.0
    before: float = 0.0
    place: float | None = None
    split: bool = False
    origin: int = 0
    slope_error: Array | None = None
    changed: bool | None = None

    @cached_property
    def distance(self) -> Array:
        """Distance driven at each row, (n,) m."""
        return cumulative_integral(self.time, self.speed)

    @property
    def along(self) -> Array:
        """Distance driven at each row since the first fitted part of the log began, (n,) m."""
        return self.before + self.distance

    @property
    def levels(self) -> dict[str, float]:
        """Standard deviation of the white noise in a sample of each measured channel, in its unit."""
        channels = {"speed": self.speed, "acceleration": self.acceleration, **self.inputs}
        found = {n: channels.get(n) for n in ("speed", "acceleration", "drive_torque", "drive_force")}
        measured = {n: c for n, c in found.items() if isinstance(c, np.ndarray)}
        if self.split:
            return {"speed": SPLIT_LEVEL}
        return {n: max(white_level(c, self.time), LOWEST_LEVEL) for n, c in measured.items()}

    def channel(self, name: str) -> Array:
        """A fitted channel, speed or acceleration, (n,)."""
        values = self.speed if name == "speed" else self.acceleration
        assert values is not None
        return values
