"""The gain of a logged position over the integral of the speed, and whether all runs contradict a gain of one.

    x(t) = x0 + sense * (g S(t) + d V(t)),   S = integral of V dt

g is 1/(1 + e) if the speed reads (1 + e) times the true one; d is the delay of the speed behind the position, which
would otherwise be mistaken for a gain, since the speed decreases during the whole coast-down. Neither road nor wind
affects g, as both channels measure the motion itself. All runs share the sensors, so that the scatter of their gains
gives the uncertainty of the common gain. What the car drove during gaps of the clock counts for neither channel: the
logger may have paused there, and the speed is not known.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.errors import Finding

FEWEST_SAMPLES = 20  # samples with both channels
BINS = 20  # of a run, over which the residual is averaged: reduces the noise of the position, keeps curvature
LATEST = 3.0  # s, largest delay between a receiver's speed and position; more is a curved path
CURVED = 0.1  # of |g - 1| times the distance: a larger residual means a position along another line, not a gain


@dataclass(frozen=True)
class CommonGain:
    """Mean gain of the position over the integral of the speed, and half the width of its 95 % interval."""

    value: float
    half: float
    runs: int

    @property
    def speed_error_std(self) -> float:
        """Standard deviation of the speed's relative gain error, with the usual error of sensors."""
        return float(np.hypot(self.half, QUALITY.largest_gain_error)) / NORMAL95

    @property
    def contradicts(self) -> bool:
        """Whether the gain differs from one by more than its interval plus the usual error of sensors."""
        return abs(self.value - 1.0) > self.half + QUALITY.largest_gain_error

    @property
    def fact(self) -> str:
        """Text such as ``"by position the speed reads 2.8 % too low in all 8 runs (...)"``."""
        off = 1.0 / self.value - 1.0
        way = "high" if off > 0 else "low"
        return (
            f"by position the speed reads {100 * abs(off):.1f} % too {way} in all {self.runs} runs (position is "
            f"{self.value:.4f} +- {self.half:.4f} times the integral of speed)"
        )


def distance_gain(time: Array, speed: Array, position: Array) -> float | None:
    """The gain g of one run, by least squares of the module's equation.

    None for fewer than ``FEWEST_SAMPLES`` samples, a short distance, a delay above ``LATEST``, or a residual that is
    curved over the distance, so that the gain is not constant.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m; NaN where a sample is missing.
    """
    good = np.isfinite(speed) & np.isfinite(position)
    if np.count_nonzero(good) < FEWEST_SAMPLES:
        return None
    speed = np.abs(speed[good])
    driven, place = over_ground(time[good], speed, position[good])
    if driven[-1] < QUALITY.shortest_distance:
        return None
    place = place * (1.0 if place[-1] >= 0.0 else -1.0)
    law, left = _fit(driven, speed, place)
    gain = float(law[1])
    rest = [float(part.mean()) for part in np.array_split(left, BINS)]
    straight = float(np.std(rest)) <= CURVED * abs(gain - 1.0) * driven[-1] + QUALITY.position_noise
    return gain if straight and abs(float(law[2])) <= LATEST else None


def over_ground(time: Array, speed: Array, position: Array) -> tuple[Array, Array]:
    """The integral of the speed and the position, both from 0 at the first sample and constant over gaps, (n,) each, m.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m.
    """
    steps = np.stack([0.5 * np.diff(time) * (speed[1:] + speed[:-1]), np.diff(position)])
    steps[:, clock_gaps(time)] = 0.0
    driven, place = np.concatenate([np.zeros((2, 1)), np.cumsum(steps, axis=1)], axis=1)
    return driven, place


def is_integral(time: Array, speed: Array, position: Array) -> bool:
    """Whether the position may be the integral of this speed, so that it cannot tell the speed's gain.

    A receiver's position deviates from the integral by its own noise, an integrated speed by rounding only.

    Parameters
    ----------
    time, speed, position : (n,) s, m/s, m; NaN where a sample is missing.
    """
    good = np.isfinite(speed) & np.isfinite(position)
    if np.count_nonzero(good) < FEWEST_SAMPLES:
        return True
    speed = np.abs(speed[good])
    driven, place = over_ground(time[good], speed, position[good])
    steps = np.abs(np.diff(place))
    resolution = float(np.min(steps[steps > 0.0], initial=np.inf))
    left = _fit(driven, speed, place)[1]
    return float(np.std(left)) <= max(QUALITY.integrated_position, resolution)


def _fit(driven: Array, speed: Array, place: Array) -> tuple[Array, Array]:
    """x0, g and d (3,) of the module's equation, and the residual (n,), m."""
    design = np.column_stack([np.ones_like(driven), driven, speed])
    law = np.linalg.lstsq(design, place, rcond=None)[0]
    return np.asarray(law), np.asarray(place - design @ law)


def common_gain(gains: Sequence[float]) -> CommonGain | None:
    """Mean of the runs' gains and half of Student's 95 % interval from their scatter; None for fewer than two runs."""
    if len(gains) < 2:
        return None
    from scipy.special import stdtrit

    spread = float(np.std(gains, ddof=1)) / np.sqrt(len(gains))
    return CommonGain(float(np.mean(gains)), float(stdtrit(len(gains) - 1.0, 0.975)) * spread, len(gains))


def gain_finding(gain: CommonGain, material: bool) -> Finding:
    """The finding that all runs contradict a gain of one; the remedy is the key that corrects the speed.

    Parameters
    ----------
    gain : common gain of the runs.
    material : it shifts the result by more than its intervals allow, so that the finding is a fault, not a note.
    """
    remedy = (
        f"add 'scale: {gain.value:.4f}' to the channel of the speed (or correct wheel_radius by it); if the "
        f"position is wrong, add 'scale: {1.0 / gain.value:.4f}' to the channel position"
    )
    what = gain.fact if material else f"{gain.fact}; the result's intervals include this error"
    return Finding("channels", what, "", remedy, fault=material, doubt=material)
