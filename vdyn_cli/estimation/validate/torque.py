"""Drive and brake torque without most of their sensors' noise.

Noise in an input is worse than noise in an output: it shakes the simulated shafts as no real torque does, and a fit
that sees them shake more than the measured ones makes them stiffer or more damped. So every sample is replaced by the
end of a straight line through its neighbours, before and after it, as many as lie on one line within the noise: a ramp
stays a ramp and a corner a corner. (Intersection of confidence intervals: Katkovnik, IEEE Trans. Signal Process. 47
(1999) 2567.) A driver does not wait for a sample: where the lines before and after two samples meet between them,
there the corner is. Cut off, it would be a knock that the simulated shafts do not feel.

Whenever a driver lets go of a pedal the torque comes back to one level, which all those stretches tell together: half a
newton metre decides on which flank a gearing with play then rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.drive import Points
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
SHARP = 4.0  # standard deviations by which the slopes of two lines must differ to make a corner
STRAIGHT = 8  # samples that such a line has at least: what swings is straight over fewer
EDGE = 1e-3  # of a spacing: a corner so near a sample is that sample

NEAR = 5.0  # noise levels of no torque, within which the level lies to which it comes back
FEWEST = 30  # samples of a stretch at that level
ALIKE = 4.0  # standard deviations by which such a stretch, and a mean over FEWEST of its samples, may differ


@dataclass(frozen=True, eq=False)
class Torques:
    """Torques at the samples of a stretch, and corners between samples."""

    values: Mapping[str, Array]
    corners: Mapping[str, Points]


@dataclass(frozen=True, eq=False)
class Fed:
    """A stretch's torques as the simulated car shall feel them, and with more noise of their sensors' size."""

    calm: Torques
    shaken: Torques


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
    names = [n for n in SHAKING if n in inputs]
    levels = {n: max(white_level(torques[n], s.time), LEAST_TORQUE) for n in names}
    if not shafts:
        more = {n: torques[n] + levels[n] * noise[k] for k, n in enumerate(names)}
        return Fed(Torques({n: torques[n] for n in names}, {}), Torques(more, {}))
    calm = {n: denoised(s.time, torques[n], levels[n]) for n in names}
    shaken = {n: denoised(s.time, calm[n][0] + levels[n] * noise[k], levels[n]) for k, n in enumerate(names)}
    return Fed(_torques(calm), _torques(shaken))


def _torques(found: Mapping[str, tuple[Array, Points]]) -> Torques:
    return Torques({n: values for n, (values, _) in found.items()}, {n: c for n, (_, c) in found.items() if c[0].size})


def denoised(time: Array, torque: Array, level: float) -> tuple[Array, Points]:
    """The torque (n,), N m, whose samples carry white noise of ``level``; and its corners between samples."""
    before = _one_sided(time, torque, level)
    after = _one_sided(-time[::-1], torque[::-1], level).turned
    weight = after.variance / (before.variance + after.variance)
    values = _come_back(torque, weight * before.values + (1.0 - weight) * after.values, level)
    return values, _corners(time, values, before, after)


def _come_back(torque: Array, values: Array, level: float) -> Array:
    """The denoised values, of stretches at the level of no torque that all of them have in common."""
    near = np.abs(values) < NEAR * level
    if np.count_nonzero(near) < FEWEST:
        return values
    common = float(np.median(torque[near]))
    at = np.flatnonzero(np.abs(values - common) < ALIKE * level)
    stretches = [s for s in np.split(at, np.flatnonzero(np.diff(at) > 1) + 1) if s.size >= FEWEST]
    back = values
    for _ in range(2):
        same = [s for s in stretches if _is_level(torque[s], common, level)]
        if same:
            every = np.concatenate(same)
            common = float(torque[every].mean())
            back = values.copy()
            back[every] = common
    return back


def _is_level(torque: Array, common: float, level: float) -> bool:
    """Are the mean of a stretch and those of its pieces what they are about a common level?"""
    pieces = np.array_split(torque, max(1, torque.size // FEWEST))
    return all(abs(p.mean() - common) < ALIKE * level / np.sqrt(p.size) for p in (torque, *pieces))


@dataclass(frozen=True, eq=False)
class _Lines:
    """At every sample the line that ends there: its value, and its slope where it is long enough."""

    values: Array
    variance: Array
    slopes: Array
    slope_variance: Array

    @property
    def turned(self) -> _Lines:
        """Seen the other way in time."""
        return _Lines(self.values[::-1], self.variance[::-1], -self.slopes[::-1], self.slope_variance[::-1])


def _corners(time: Array, values: Array, before: _Lines, after: _Lines) -> Points:
    """Where the line up to a sample and the line from the next one meet between the two."""
    spacing = np.diff(time)
    turn = before.slopes[:-1] - after.slopes[1:]
    sharp = np.abs(turn) / np.sqrt(before.slope_variance[:-1] + after.slope_variance[1:])
    apart = after.values[1:] - after.slopes[1:] * spacing - before.values[:-1]
    since = np.divide(apart, turn, out=np.zeros_like(turn), where=turn != 0)
    beside = np.r_[0.0, sharp, 0.0]
    inside = (since > EDGE * spacing) & (since < (1 - EDGE) * spacing)
    there = inside & (sharp > SHARP) & (sharp >= beside[:-2]) & (sharp > beside[2:])
    return time[:-1][there] + since[there], (before.values[:-1] + before.slopes[:-1] * since)[there]


def _one_sided(time: Array, values: Array, level: float) -> _Lines:
    """Estimates at every sample from those before it and itself."""
    best, variance = values.copy(), np.full(values.size, level**2)
    slopes, slope_variance = np.zeros(values.size), np.full(values.size, np.inf)
    low, high = values - WIDTH * level, values + WIDTH * level
    going = np.ones(values.size, dtype=bool)
    spacing = float(np.median(np.diff(time)))
    for reach in REACHES:
        if reach * spacing > LONGEST or reach >= values.size:
            break
        line, spread, slope, square = _line_ends(time, values, reach)
        sigma = level * np.sqrt(spread)
        lower, upper = np.maximum(low, line - WIDTH * sigma), np.minimum(high, line + WIDTH * sigma)
        going &= (lower <= upper) & (np.arange(values.size) >= reach)
        best, variance = np.where(going, line, best), np.where(going, sigma**2, variance)
        straight = going & (reach >= STRAIGHT)
        slopes, slope_variance = (
            np.where(straight, slope, slopes),
            np.where(straight, level**2 / square, slope_variance),
        )
        low, high = np.where(going, lower, low), np.where(going, upper, high)
    return _Lines(best, variance, slopes, slope_variance)


def _line_ends(time: Array, values: Array, reach: int) -> tuple[Array, Array, Array, Array]:
    """Ends of straight lines through each sample and ``reach`` before it, with their variance for noise of one.

    And the lines' slopes, with the inverse of theirs.
    """
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
    return np.r_[pad, ends], np.r_[pad + 1.0, spread], np.r_[pad, slope], np.r_[pad + 1.0, square]
