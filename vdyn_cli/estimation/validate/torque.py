"""Drive and brake torque without most of their sensors' noise.

Noise in an input is worse than noise in an output: it shakes the simulated shafts as no real torque does, and a fit
that sees them shake more than the measured ones makes them stiffer or more damped. So every sample is replaced by the
end of a straight line through its neighbours, before and after it, as many as lie on one line within the noise: a ramp
stays a ramp and a corner a corner. (Intersection of confidence intervals: Katkovnik, IEEE Trans. Signal Process. 47
(1999) 2567.)
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.estimation.validate.drives import Stretch, driving
from vdyn_cli.fit import white_level
from vdyn_cli.log import Log

Array = NDArray[np.float64]

TORQUES = ("drive_torque", "drive_torque_left", "drive_torque_right")
SHAKING = (*TORQUES, "brake_torque")  # inputs whose noise shakes the simulated car
LEAST_TORQUE = 1e-3  # N m of noise in a torque
SEED = 20170401  # of the noise that is added to the torque

REACHES = (2, 4, 8, 16, 32, 64, 128)  # samples to one side
LONGEST = 1.5  # s to one side
WIDTH = 2.0  # standard deviations of the intervals that must meet


@dataclass(frozen=True, eq=False)
class Fed:
    """A stretch's torques as the simulated car shall feel them, and with more noise of their sensors' size."""

    calm: Mapping[str, Array]
    shaken: Mapping[str, Array]


@lru_cache(maxsize=2)
def fed(stretches: tuple[Stretch, ...], inputs: tuple[str, ...], shafts: bool) -> tuple[Fed, ...]:
    """Torques of every stretch, of those that a model takes: without noise where ``shafts`` are there to be shaken."""
    return tuple(_fed(k, s, inputs, shafts) for k, s in enumerate(stretches))


def _fed(run: int, s: Stretch, inputs: tuple[str, ...], shafts: bool) -> Fed:
    torques = dict(s.inputs)
    if "drive_torque" in inputs and "drive_torque" not in torques:
        torques["drive_torque"] = driving(Log(s.name, s.time, s.inputs))
    rng = np.random.default_rng([SEED, run])
    noise = rng.standard_normal((len(SHAKING), s.time.size))
    calm, shaken = {}, {}
    for k, name in enumerate(n for n in SHAKING if n in inputs):
        level = max(white_level(torques[name], s.time), LEAST_TORQUE)
        calm[name] = denoised(s.time, torques[name], level) if shafts else torques[name]
        more = calm[name] + level * noise[k]
        shaken[name] = denoised(s.time, more, level) if shafts else more
    return Fed(calm, shaken)


def denoised(time: Array, torque: Array, level: float) -> Array:
    """The torque (n,), N m, whose samples carry white noise of ``level``."""
    before, before_variance = _one_sided(time, torque, level)
    after, after_variance = (a[::-1] for a in _one_sided(-time[::-1], torque[::-1], level))
    weight = after_variance / (before_variance + after_variance)
    return np.asarray(weight * before + (1.0 - weight) * after)


def _one_sided(time: Array, values: Array, level: float) -> tuple[Array, Array]:
    """Estimates at every sample from those before it and itself, and their variances."""
    best, variance = values.copy(), np.full(values.size, level**2)
    low, high = values - WIDTH * level, values + WIDTH * level
    going = np.ones(values.size, dtype=bool)
    spacing = float(np.median(np.diff(time)))
    for reach in REACHES:
        if reach * spacing > LONGEST or reach >= values.size:
            break
        line, spread = _line_ends(time, values, reach)
        sigma = level * np.sqrt(spread)
        lower, upper = np.maximum(low, line - WIDTH * sigma), np.minimum(high, line + WIDTH * sigma)
        going &= (lower <= upper) & (np.arange(values.size) >= reach)
        best, variance = np.where(going, line, best), np.where(going, sigma**2, variance)
        low, high = np.where(going, lower, low), np.where(going, upper, high)
    return best, variance


def _line_ends(time: Array, values: Array, reach: int) -> tuple[Array, Array]:
    """Ends of straight lines through each sample and ``reach`` before it; variance for noise of one."""
    windows = np.lib.stride_tricks.sliding_window_view
    t = windows(time, reach + 1)
    t = t - t[:, -1:]
    x = windows(values, reach + 1)
    middle = t.mean(axis=1, keepdims=True)
    square = np.sum((t - middle) ** 2, axis=1)
    slope = np.sum((t - middle) * x, axis=1) / square
    ends = x.mean(axis=1) - slope * middle[:, 0]
    spread = 1.0 / (reach + 1) + middle[:, 0] ** 2 / square
    pad = np.zeros(reach)
    return np.r_[pad, ends], np.r_[pad + 1.0, spread]
