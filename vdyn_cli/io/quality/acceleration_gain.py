"""Gain of a measured acceleration over the rate of the speed, as an interval.

With x the change of the speed and y the integral of the acceleration in windows of a second, y = g x + c. Noise of
either, and the slope of the road, lower the gain of the regression of y on x and raise that of x on y: without
correlation between the errors, the true gain lies between both (Fuller, Measurement Error Models, section 1.1). A slope
that changes steadily over a coast-down resembles a gain of another size, so that only a lively drive determines small
deviations. Hills last for longer than a pull of the engine, and few of them leave the correlation of slope and
acceleration to chance; a sensor's gain is the same at any frequency. So the interval includes the gain of the fast
changes alone.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.quality.gain_changes import fast_changes, long_run_variance
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.unit_mistakes import ACCELERATION_MISTAKES, usual_mistake

FEWEST_WINDOWS = 3  # windows


@dataclass(frozen=True)
class AccelerationGain:
    """The gain, signed, and the interval of its size: ``low`` to ``high``, both regressions with standard errors."""

    value: float
    low: float
    high: float

    def differs(self, limit: float) -> bool:
        """Whether the gain is negative, or its whole interval differs from 1 by more than ``limit``."""
        return self.value < 0.0 or self.low > 1.0 + limit or self.high < 1.0 / (1.0 + limit)

    @property
    def mistake(self) -> str:
        """The mistaken units that explain the gain, such as "g read as m/s^2"; empty if none does."""
        if not self.differs(QUALITY.refused_scale):
            return ""
        return usual_mistake(abs(self.value), ACCELERATION_MISTAKES, QUALITY.near_unit_factor)


def acceleration_gain(change: Array, gained: Array) -> AccelerationGain | None:
    """The gain from windows; None if the two are hardly correlated (``least_likeness``).

    Parameters
    ----------
    change, gained : (n,) m/s, change of the speed and integral of the acceleration in each window.
    """
    if change.size < FEWEST_WINDOWS or not np.ptp(change) > 0.0 or not np.ptp(gained) > 0.0:
        return None
    found = _interval(change - change.mean(), gained - gained.mean())
    fast = None if found is None else _interval(fast_changes(change), fast_changes(gained))
    if found is None or fast is None:
        return found
    return AccelerationGain(found.value, min(found.low, fast.low), max(found.high, fast.high))


def _interval(x: Array, y: Array) -> AccelerationGain | None:
    """The gain of y (n,) over x (n,), both with a mean of zero; None if they are hardly correlated."""
    xx, yy, xy = float(x @ x), float(y @ y), float(x @ y)
    if not abs(xy) >= max(QUALITY.least_likeness * np.sqrt(xx * yy), 1e-300):
        return None
    first, second = abs(xy) / xx, yy / abs(xy)
    y = y * np.sign(xy)
    errors = [np.sqrt(long_run_variance(a * (b - a * abs(xy) / aa))) / aa for a, b, aa in ((x, y, xx), (y, x, yy))]
    low = first - QUALITY.scale_errors * errors[0]
    high = second + QUALITY.scale_errors * errors[1] * second**2
    return AccelerationGain(float(np.copysign(np.sqrt(yy / xx), xy)), float(low), float(high))
