"""Drive and brake torque without most of their sensors' noise.

Noise in an input is worse than noise in an output: it shakes the simulated shafts as no real torque does, and a fit
that sees them shake more than the measured ones makes them stiffer or more damped. So every sample is replaced by the
ends of straight lines through its neighbours, before and after it, as many as lie on one line within the noise: a ramp
stays a ramp (`lines`). A driver does not wait for a sample: where lines meet between samples, there the corner is
(`corners`). Cut off, it would be a knock that the simulated shafts do not feel.

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
from vdyn_cli.inference import white_level
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.corners import with_corners
from vdyn_cli.steps.validate.drives import Stretch, driving
from vdyn_cli.steps.validate.lines import lines_after, lines_before

Array = NDArray[np.float64]

TORQUES = ("drive_torque", "drive_torque_left", "drive_torque_right")
SHAKING = (*TORQUES, "brake_torque")  # inputs whose noise shakes the simulated car
LEAST_TORQUE = 1e-3  # N m of noise in a torque
SEED = 20170401  # of the noise that is added to the torque

NEAR = 5.0  # noise levels of no torque, within which the level lies to which it comes back
FAR = 3.0  # standard deviations of the sensor's zero, within which it lies too
FEWEST = 30  # samples of a stretch at that level
ALIKE = 4.0  # standard deviations by which such a stretch, and a mean over a part of it, may differ


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
def fed(stretches: tuple[Stretch, ...], inputs: tuple[str, ...], shafts: bool, zero: float) -> tuple[Fed, ...]:
    """Torques of every stretch, of those that a model takes: without noise where ``shafts`` are there to be shaken.

    ``zero``: N m, standard deviation of what the drive torque reads at no torque.
    """
    return tuple(_fed(k, s, inputs, shafts, zero) for k, s in enumerate(stretches))


def _fed(run: int, s: Stretch, inputs: tuple[str, ...], shafts: bool, zero: float) -> Fed:
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
    zeros = {n: zero if n in TORQUES else 0.0 for n in names}
    calm = {n: denoised(s.time, torques[n], levels[n], zeros[n]) for n in names}
    more = {n: calm[n][0] + levels[n] * noise[k] for k, n in enumerate(names)}
    shaken = {n: denoised(s.time, more[n], levels[n], zeros[n]) for n in names}
    return Fed(_torques(calm), _torques(shaken))


def _torques(found: Mapping[str, tuple[Array, Points]]) -> Torques:
    return Torques({n: values for n, (values, _) in found.items()}, {n: c for n, (_, c) in found.items() if c[0].size})


def denoised(time: Array, torque: Array, level: float, zero: float = 0.0) -> tuple[Array, Points]:
    """The torque (n,), N m, whose samples carry white noise of ``level``; and its corners between samples.

    ``zero``: N m, standard deviation of what the sensor reads at no torque.
    """
    before, after = lines_before(time, torque, level), lines_after(time, torque, level)
    weight = after.variance / (before.variance + after.variance)
    values = weight * before.values + (1.0 - weight) * after.values
    values, corners = with_corners(time, torque, values, (before, after), level)
    return _come_back(torque, values, np.searchsorted(corners[0], time), level, zero), corners


def _come_back(torque: Array, values: Array, piece: NDArray[np.int64], level: float, zero: float) -> Array:
    """The denoised values, of stretches at the level of no torque that all of them have in common.

    ``piece`` (n,) counts the corners before each sample: a ramp that begins at that level has no part in the stretch.
    """
    near = np.sort(values[np.abs(values) < max(NEAR * level, FAR * zero)])
    if near.size < FEWEST:
        return values
    crowd = np.searchsorted(near, near + level) - np.searchsorted(near, near - level)
    common = float(np.median(torque[np.abs(values - near[np.argmax(crowd)]) < level]))
    at = np.flatnonzero(np.abs(values - common) < ALIKE * level)
    apart = (np.diff(at) > 1) | (np.diff(piece[at]) > 0)
    stretches = np.split(at, np.flatnonzero(apart) + 1)
    back = values
    for _ in range(2):
        same = [s for s in stretches if s.size >= FEWEST and _is_level(torque[s], common, level)]
        if same:
            every = np.concatenate(same)
            common = float(torque[every].mean())
            back = values.copy()
            back[every] = common
    return back


def _is_level(torque: Array, common: float, level: float) -> bool:
    """Are the mean of a stretch and those of its parts, ever shorter ones, what they are about a common level?"""
    halvings = range(int(np.log2(max(torque.size / FEWEST, 1.0))) + 1)
    pieces = [p for k in halvings for p in np.array_split(torque, 2**k)]
    return all(abs(p.mean() - common) < ALIKE * level / np.sqrt(p.size) for p in pieces)
