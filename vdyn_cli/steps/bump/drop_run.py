"""One drop prepared for the fit: the log from the release on, its heights, their noise and start values."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.engine.simulate import Drive
from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

HELD = 10  # samples at the start of a log whose median is the height at which the car is held
MOVED = 8.0  # standard deviations of the noise that show motion: white noise stays below 5
AFTER = 4.0  # s that are fitted after the release: five or more oscillations of a body
LAST = 0.25  # last share of the drop, in which the car is nearly at rest
FEWEST_SAMPLES = 100  # after the release: 50 Hz for two seconds
SMALLEST = 20.0  # least largest height above rest, in units of the noise
SLOPE_SAMPLES = 7  # from which the first rate is estimated


@dataclass(frozen=True)
class DropRun:
    """One drop from its release on.

    Parameters
    ----------
    run : the log's name. time : (n,) s. heights : each channel (n,), m, NaN where there is no reading.
    noise : of each, standard deviation of its white noise.
    """

    run: str
    time: Array
    heights: Mapping[str, Array]
    noise: Mapping[str, float]

    @cached_property
    def rest(self) -> dict[str, float]:
        """Final value of each height, m: the mean of the last part."""
        late = self.time > self.time[-1] - LAST * (self.time[-1] - self.time[0])
        return {n: float(np.nanmean(v[late])) for n, v in self.heights.items()}

    def first(self, channel: str) -> tuple[float, float]:
        """The first height above rest, m, and its rate, m/s."""
        values = self.heights[channel] - self.rest[channel]
        good = np.flatnonzero(np.isfinite(values))[:SLOPE_SAMPLES]
        time = self.time[good] - self.time[0]
        rate, height = np.polyfit(time, values[good], 1)
        return float(height), float(rate)

    @cached_property
    def drive(self) -> Drive:
        """Times of the simulation, which has no other input."""
        return Drive(self.time, {"elapsed": self.time - self.time[0]})

    def frequency(self, channel: str) -> float:
        """The dominant frequency, Hz: the peak of the spectrum."""
        good = np.isfinite(self.heights[channel])
        step = (self.time[-1] - self.time[0]) / (self.time.size - 1)
        even = np.arange(self.time[0], self.time[-1], step)
        values = np.interp(even, self.time[good], self.heights[channel][good] - self.rest[channel])
        size = 16 * values.size
        spectrum = np.abs(np.fft.rfft(values - values.mean(), size))
        return float(np.fft.rfftfreq(size, step)[np.argmax(spectrum)])


def drop_run(log: Log, channels: Sequence[str], release: float | None) -> DropRun:
    """The part of a log from the release on, ``AFTER`` s long.

    Parameters
    ----------
    channels : heights, those of the body first. release : log time, s; None: the first motion of the body.
    """
    noise = {n: white_level(log[n], log.time) for n in channels}
    bodies = [n for n in channels if n.startswith("body")]
    start = log.time[_first_motion(log, bodies, noise)] if release is None else release
    part = log.between(float(start), float(start) + AFTER)
    return DropRun(log.name, part.time, {n: part[n] for n in channels}, noise)


def _first_motion(log: Log, channels: Sequence[str], noise: Mapping[str, float]) -> int:
    """The first sample at which any body height differs from its held value; 0 where the log begins in motion.

    Only the body is held: wheels may move before the release, as when the car has just been lifted.
    """
    found = log.time.size
    for name in channels:
        away = np.abs(log[name] - np.nanmedian(log[name][:HELD])) > MOVED * max(noise[name], 1e-9)
        steady = np.flatnonzero(away[:-2] & away[1:-1] & away[2:])
        found = min(found, int(steady[0])) if steady.size else found
    return found if HELD < found < log.time.size else 0


def wrong_drop(run: DropRun) -> list[Finding]:
    """Findings on a drop of fewer than ``FEWEST_SAMPLES``, or in which the body moves less than ``SMALLEST`` noises."""
    if run.time.size < FEWEST_SAMPLES:
        what = f"has {run.time.size} samples after the release: {FEWEST_SAMPLES} are needed"
        return [Finding(run.run, what, "", "log until the car is at rest, or at a higher rate")]
    body = [n for n in run.heights if n.startswith("body")]
    if all(np.nanmax(np.abs(run.heights[n] - run.rest[n])) < SMALLEST * run.noise[n] for n in body):
        return [Finding(run.run, "the body does not move", "", "check the channels, or write 'release' with its time")]
    return []
