"""One crossing prepared for the fit: the part of a log around the bump, its channels, their noise, a smooth speed."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Drive
from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array, cumulative_integral, filled
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.bump.smooth_speed import SmoothSpeed, smooth_speed

LOADS = ("front_load", "rear_load")
BODY_CHANNELS = ("vertical_acceleration", "pitch_rate")
CHANNELS = (*LOADS, *BODY_CHANNELS)
# s that are fitted before the front axle meets the bump, and after the rear axle does: at 1.2 Hz and 0.3 of critical
# damping the body's motion has decayed below 1 % of its first amplitude (exp(-0.3 2 pi 1.2 2.5) = 0.004)
BEFORE, AFTER = 1.0, 2.5

Ground = tuple[Array, Array]  # positions and heights (n,) of the road, m, the bump from 0 on


@dataclass(frozen=True)
class Crossing:
    """One run around its bump.

    Parameters
    ----------
    run : the log's name. time : (n,) s, as logged.
    channels : each (n,), NaN where there is no usable reading. noise : of each, standard deviation of its white noise.
    speed : smoothed. origin : m traveled since the log's start at the first sample.
    distance : m from the log's start to the bump's near edge, as located by ``find_bump``.
    clipped : for each channel, number of samples at the sensor's limit, which are left out.
    """

    run: str
    time: Array
    channels: Mapping[str, Array]
    noise: Mapping[str, float]
    speed: SmoothSpeed
    origin: float
    distance: float
    clipped: Mapping[str, int]

    @property
    def pace(self) -> float:
        """Mean speed, m/s."""
        return float(np.mean(self.speed.value))

    @cached_property
    def drive(self) -> Drive:
        """What the simulation of the crossing needs: times, speed with elapsed time, and the initial position, SI."""
        inputs = {"speed": self.speed.value, "elapsed": self.speed.elapsed}
        return Drive(self.time, inputs, {"position": self.origin})


def traveled(log: Log) -> Array:
    """Distance (n,) since the log's start, m: the integral of the measured speed."""
    return cumulative_integral(log.time, filled(log.time, log["speed"]))


def cut_crossing(
    log: Log, distance: float, alone: tuple[float, float], wheelbase: float, mass: float, ground: Ground
) -> Crossing:
    """The part of a log from ``BEFORE`` s before the front axle meets the bump to ``AFTER`` s after the rear axle does.

    Parameters
    ----------
    distance : from the log's start to the bump's near edge, m. alone : distances, m, outside of which the car responds
        to other bumps; nothing there is used. wheelbase : m. mass : of the car, kg.
    """
    way = traveled(log)
    meets = np.interp([distance, distance + wheelbase], way, log.time)
    start, stop = np.interp(alone, way, log.time, left=-np.inf, right=np.inf)
    part = log.between(max(float(meets[0]) - BEFORE, float(start)), min(float(meets[1]) + AFTER, float(stop)))
    first = int(np.searchsorted(log.time, part.time[0]))
    names = [n for n in CHANNELS if n in log]
    noise = {n: white_level(part[n], part.time) for n in names}
    channels, clipped = {}, {}
    for name in names:
        cut_off = at_limit(part[name], noise[name])
        channels[name] = np.where(cut_off, np.nan, part[name])
        clipped[name] = int(np.count_nonzero(cut_off))
    loads = {0.0: part["front_load"], wheelbase: part["rear_load"]}
    climb = sum(_climb(way[first : first + part.time.size] - distance - b, f, ground) for b, f in loads.items())
    speed = smooth_speed(part.time, part["speed"], -cumulative_integral(part.time, np.asarray(climb)) / mass)
    return Crossing(log.name, part.time, channels, noise, speed, float(way[first]), distance, clipped)


def _climb(past: Array, load: Array, ground: Ground) -> Array:
    """Backward force Fz u' (n,) of the road's slope on an axle, N, at ``past`` (n,), m beyond the bump's near edge."""
    along, height = ground
    slope = np.interp(past, along, np.gradient(height, along), left=0.0, right=0.0)
    return np.asarray(np.where(np.isfinite(load), load, 0.0) * slope)


def at_limit(values: Array, noise: float) -> NDArray[np.bool_]:
    """Mask (n,) of samples at the sensor's limit: three or more in a row at a nonzero maximum or minimum.

    Samples within three standard deviations of the limit are included, because it cuts off their noise on one side.

    Parameters
    ----------
    values : (n,). noise : standard deviation of their white noise, in the same unit.
    """
    found = np.zeros(values.size, dtype=bool)
    for end in (np.nanmax(values), np.nanmin(values)):
        at = values == end
        row = at[:-2] & at[1:-1] & at[2:]
        if end == 0.0 or noise == 0.0 or not row.any():
            continue
        found |= np.abs(values - end) <= 3 * noise
    return found
