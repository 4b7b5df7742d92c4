"""Denoised drive and brake torque as inputs of the simulation.

Noise in an input is worse than noise in an output: it excites the simulated shafts as no real torque does, and a fit
then makes them too stiff or too damped. Every sample is therefore replaced by the mean of the ends of two straight
lines through its neighbors before and after it, each as long as the samples are on it within the noise, so that a ramp
stays a ramp (``line_fits``). Where lines meet between samples, a corner is inserted (``broken_lines``); without it,
tip-ins would be too smooth.

Whenever the driver releases the pedal, the torque returns to one level, which is estimated from all these segments
together: half a newton meter decides on which flank a gear with play rests.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.drive import Drive, Points
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.drives.broken_lines import off_samples, with_corners
from vdyn_cli.steps.validate.drives.complete_inputs import DRIVE_TORQUES
from vdyn_cli.steps.validate.drives.line_fits import lines_after, lines_before
from vdyn_cli.steps.validate.drives.segments import RUN_START, DriveSegment, total_drive_torque

NOISY_INPUTS = (*DRIVE_TORQUES, "brake_torque")  # inputs whose noise excites the simulated car
LEAST_TORQUE = 1e-3  # N m, least noise of a torque
SEED = 20170401  # of the noise that is added to the torque

NEAR = 5.0  # noise levels from zero, the range of the released-pedal level
FAR = 3.0  # standard deviations of the sensor's zero, the same range; the larger one is used
FEWEST_AT_LEVEL = 30  # samples of a segment at that level
ALIKE = 4.0  # standard deviations from the level, the limit for samples and for means of segments


@dataclass(frozen=True, eq=False)
class TorqueSignals:
    """Torques at the samples of a segment, N m, and their corners between samples, by input."""

    values: Mapping[str, Array]
    corners: Mapping[str, Points]


@dataclass(frozen=True, eq=False)
class DriveInputs:
    """The inputs of the simulation for every segment; denoised once.

    Parameters
    ----------
    segments : all simulated ones. model : defines the inputs.
    zero : N m, standard deviation of the zero of the drive torque's sensor.
    air_density : kg/m^3 at the temperature ``day`` (K), if the density depends on each segment's temperature; None:
        that of the parameters for all segments.
    read_radius : m, by which the speed was computed from a wheel's, for a model that reads it so.
    """

    segments: tuple[DriveSegment, ...]
    model: Model
    zero: float = 0.0
    air_density: float | None = None
    day: float = 293.15
    read_radius: float = 0.0

    @cached_property
    def torques(self) -> tuple[tuple[TorqueSignals, TorqueSignals], ...]:
        """Denoised torques of every segment, and the same with additional noise of their sensors' level.

        As measured for a mass on a road, which has no shafts.
        """
        denoise = self.model.name == "vehicle"
        return tuple(_segment_torques(k, s, self.model.inputs, denoise, self.zero) for k, s in enumerate(self.segments))

    @cached_property
    def drives(self) -> tuple[Drive, ...]:
        """Inputs of the simulator."""
        return tuple(self._drive(s, denoised) for s, (denoised, _) in zip(self.segments, self.torques, strict=True))

    @cached_property
    def perturbed_drives(self) -> tuple[Drive, ...]:
        """Inputs of the simulator with additional noise of the torque sensors' level."""
        return tuple(self._drive(s, noisy) for s, (_, noisy) in zip(self.segments, self.torques, strict=True))

    def air(self, temperature: float) -> dict[str, float]:
        """The air density at this temperature (K), where it depends on it."""
        return {} if self.air_density is None else {"air_density": self.air_density * self.day / temperature}

    def _drive(self, s: DriveSegment, torques: TorqueSignals) -> Drive:
        everything = {
            **s.inputs,
            "elapsed": s.since + s.time - s.time[0],
            **{f"road_{wheel}": 0.0 for wheel in ("fl", "fr", "rl", "rr")},
            **torques.values,
        }
        inputs = {n: everything[n] for n in self.model.inputs}
        context = {"heading": s.heading, "temperature": s.temperature, RUN_START: s.run_start}
        context |= {"read_radius": self.read_radius} if self.read_radius else {}
        context |= {} if s.changed is None else {"changed": float(s.changed)}
        return Drive(s.time, inputs, {"run_time": s.since}, self.air(s.temperature), context, torques.corners)


def _segment_torques(
    run: int, s: DriveSegment, inputs: tuple[str, ...], denoise: bool, zero: float
) -> tuple[TorqueSignals, TorqueSignals]:
    torques = {**s.inputs, "drive_torque": total_drive_torque(s.inputs)} if "drive_torque" in inputs else s.inputs
    names = [n for n in NOISY_INPUTS if n in inputs]
    read = {n: s.sampled.get(n, (s.time, torques[n])) for n in names}
    rng = np.random.default_rng([SEED, run])
    noise = rng.standard_normal((len(NOISY_INPUTS), max([s.time.size, *(time.size for time, _ in read.values())])))
    levels = {n: max(white_level(torque, time), LEAST_TORQUE) for n, (time, torque) in read.items()}
    if not denoise:
        more = {n: torques[n] + levels[n] * noise[k, : s.time.size] for k, n in enumerate(names)}
        return TorqueSignals({n: torques[n] for n in names}, {}), TorqueSignals(more, {})
    zeros = {n: zero if n in DRIVE_TORQUES else 0.0 for n in names}
    clean = {n: denoised(*read[n], levels[n], zeros[n]) for n in names}
    more = {n: clean[n][0] + levels[n] * noise[k, : clean[n][0].size] for k, n in enumerate(names)}
    again = {n: denoised(read[n][0], more[n], levels[n], zeros[n]) for n in names}
    clocks = {n: time for n, (time, _) in read.items()}
    return _torques(s.time, clocks, clean), _torques(s.time, clocks, again)


def _torques(time: Array, clocks: Mapping[str, Array], found: Mapping[str, tuple[Array, Points]]) -> TorqueSignals:
    """Torques of sensors with their own clocks, at the samples of a segment (n,)."""
    placed = {n: _placed(time, clocks[n], *one) for n, one in found.items()}
    return TorqueSignals(
        {n: values for n, (values, _) in placed.items()}, {n: c for n, (_, c) in placed.items() if c[0].size}
    )


def _placed(time: Array, own: Array, values: Array, corners: Points) -> tuple[Array, Points]:
    """A torque (m,) on its own clock, interpolated to the clock ``time`` (n,), and its corners between samples."""
    if own is time:
        return values, corners
    at, heights = corners
    where = np.searchsorted(own, at)
    apart = off_samples(at, time)
    whole = np.interp(time, np.insert(own, where, at), np.insert(values, where, heights))
    return whole, (at[apart], heights[apart])


def denoised(time: Array, torque: Array, level: float, zero: float = 0.0) -> tuple[Array, Points]:
    """The denoised torque (n,), N m, and its corners between samples.

    Parameters
    ----------
    torque : (n,) N m, with white noise of ``level``. zero : N m, standard deviation of the sensor's zero.
    """
    before, after = lines_before(time, torque, level), lines_after(time, torque, level)
    weight = after.variance / (before.variance + after.variance)
    values = weight * before.values + (1.0 - weight) * after.values
    values, corners = with_corners(time, torque, values, (before, after), level)
    return _with_released_level(torque, values, np.searchsorted(corners[0], time), level, zero), corners


def _with_released_level(torque: Array, values: Array, piece: NDArray[np.int64], level: float, zero: float) -> Array:
    """The denoised values with the common released-pedal level in all segments near zero.

    ``piece`` (n,) counts the corners before each sample, so that a ramp that begins at that level is excluded.
    """
    near = np.sort(values[np.abs(values) < max(NEAR * level, FAR * zero)])
    if near.size < FEWEST_AT_LEVEL:
        return values
    crowd = np.searchsorted(near, near + level) - np.searchsorted(near, near - level)
    common = float(np.median(torque[np.abs(values - near[np.argmax(crowd)]) < level]))
    at = np.flatnonzero(np.abs(values - common) < ALIKE * level)
    apart = (np.diff(at) > 1) | (np.diff(piece[at]) > 0)
    segments = np.split(at, np.flatnonzero(apart) + 1)
    back = values
    for _ in range(2):
        same = [s for s in segments if s.size >= FEWEST_AT_LEVEL and _is_level(torque[s], common, level)]
        if same:
            every = np.concatenate(same)
            common = float(torque[every].mean())
            back = values.copy()
            back[every] = common
    return back


def _is_level(torque: Array, common: float, level: float) -> bool:
    """Whether the mean of a segment, and the means of its halves, quarters and so on, agree with a common level."""
    halvings = range(int(np.log2(max(torque.size / FEWEST_AT_LEVEL, 1.0))) + 1)
    pieces = [p for k in halvings for p in np.array_split(torque, 2**k)]
    return all(abs(p.mean() - common) < ALIKE * level / np.sqrt(p.size) for p in pieces)
