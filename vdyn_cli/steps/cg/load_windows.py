"""A run cut into short windows over which the moment balance is integrated."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import FEWEST_READINGS, white_level
from vdyn_cli.physics.models.load_transfer import HEAVES
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.local_derivative import SPAN, derivative_reach, local_derivative
from vdyn_cli.steps.cg.unmeasured_heave import pitch_heave

if TYPE_CHECKING:
    from scipy.sparse import csr_array

WINDOW = 0.02  # s over which the balance is integrated; the body pitches at 1 to 3 Hz
LOADS = ("front_load", "rear_load")
WHEELS = {f"{n}_load": (f"{n}_left_load", f"{n}_right_load") for n in ("front", "rear")}
NOISY = (*LOADS, "acceleration", "pitch_rate", "speed")
GAP = 3.0  # usual steps of the clock, beyond which a window has a gap
# m/s: three times the noise of a speed at rest; a car that starts with 3 m/s^2 exceeds it within 0.1 s.
STANDSTILL = 0.3
# m/s, of an integrated speed: a zero of 0.05 m/s^2, minus its mean over the run, causes such an error.
UNCERTAIN_STANDSTILL = 1.0
WALK = 3.0  # standard deviations of a random walk, which chance hardly reaches
FEWEST_SAMPLES = 10  # samples of a rate whose noise can be estimated
# s, range and step of the lags of the acceleration: the response of a body has decayed after two periods at 1.3 Hz, and
# clocks may differ by 0.2 s. The step resolves the ramp of a brake within 0.1 s: with 0.08 s, what derivatives
# determine scattered by 1.1 to 1.2 times its standard deviation.
EARLIEST, LATEST, SPACING = -0.3, 1.5, 0.05
# s, standard deviation of their smoothing. Their noise is that of the balance: with 0.025 s, on eight clean days an
# unknown compliance of the tires was 9 % too low and the height 0.22 % too high; with 0.045 s, 0 % and 0.11 %.
SMOOTHED = 0.045
SAME_SPEED = 0.1  # share of a run's range of speed: a tilt of 0.5 deg causes as much in 20 s


@dataclass(frozen=True)
class LoadWindows:
    """One run's measured channels, and their integrals over windows that share their end samples.

    Parameters
    ----------
    run : the log's name. time : (n,) s of the samples. heading : +1 out, -1 back, 0 unknown.
    channels : each (n,): front_load, [rear_load], acceleration, pitch_rate, pitch, rolling, speed;
        sprung_heave, damped_heave where the rear load is not logged.
    weights : (k, m + 1), Simpson's weights of each window's samples. first : (k,), index of its first sample.
    noise : of each channel except the pitch, standard deviation of its white noise.
    """

    run: str
    time: Array
    heading: float
    channels: Mapping[str, Array]
    weights: Array
    first: NDArray[np.int64]
    noise: Mapping[str, float]

    @cached_property
    def step(self) -> float:
        """Usual time between samples, s."""
        return float(np.median(np.diff(self.time)))

    @property
    def middle(self) -> Array:
        """Middle of each window, s."""
        return np.asarray(self.time[self.first + self.weights.shape[1] // 2])

    @cached_property
    def width(self) -> Array:
        """Length of each window, s."""
        return np.asarray(self.weights.sum(axis=1))

    @property
    def loads(self) -> tuple[str, ...]:
        """The axle loads that are logged."""
        return tuple(n for n in LOADS if n in self.channels)

    @cached_property
    def integral(self) -> csr_array:
        """Matrix (k, n) of the integrals over the windows, by the samples."""
        reach = self.first[:, None] + np.arange(self.weights.shape[1])
        return self._rows(self.weights, reach)

    @cached_property
    def change(self) -> csr_array:
        """Matrix (k, n) of the last minus the first sample of each window."""
        ends = np.column_stack([self.first, self.first + self.weights.shape[1] - 1])
        return self._rows(np.tile([-1.0, 1.0], (len(ends), 1)), ends)

    @cached_property
    def integral_bend(self) -> csr_array:
        """Matrix (k, n) of the integrals of the second derivative over ``SPAN``, by the samples."""
        integral: csr_array = self.integral @ _derivatives(self.time.size, self.step, 2)
        return integral

    @cached_property
    def integral_rate(self) -> csr_array:
        """Matrix (k, n) of the integrals of the first derivative over ``SPAN``, by the samples."""
        integral: csr_array = self.integral @ _derivatives(self.time.size, self.step, 1)
        return integral

    def _rows(self, values: Array, samples: NDArray[np.int64]) -> csr_array:
        """The matrix (k, n) with values (k, m) at samples (k, m)."""
        from scipy.sparse import csr_array

        k, m = values.shape
        return csr_array((values.ravel(), samples.ravel(), m * np.arange(k + 1)), (k, self.time.size))

    def mean(self, channel: str) -> Array:
        """Mean of a channel in each window (k,)."""
        return self.integral @ self.channels[channel] / self.width

    def driven(self, lever: float) -> Array:
        """Regressors (n, r) of what the driver causes: a constant, drag, standstill, and lagged accelerations.

        Parameters
        ----------
        lever : m, height of the antenna above the center of gravity, whose acceleration they are.
        """
        at_antenna, per_lever = self._lagged
        return at_antenna + lever * per_lever

    def driven_means(self, lever: float) -> Array:
        """The means (k, r) of :meth:`driven` in each window."""
        at_antenna, per_lever = self._lagged_means
        return at_antenna + lever * per_lever

    @cached_property
    def _lagged(self) -> tuple[Array, Array]:
        return self.lagged(self.channels, SMOOTHED)

    def lagged(self, channels: Mapping[str, Array], smoothing: float) -> tuple[Array, Array]:
        """The regressors of :meth:`driven` for a lever of zero, and their derivative by it, each (n, r).

        Parameters
        ----------
        channels : acceleration, pitch_rate (n,). smoothing : standard deviation of the smoothing of these, s.
        """
        from scipy.ndimage import gaussian_filter1d

        push, rate = (
            gaussian_filter1d(channels[n], smoothing / self.step, mode="nearest")
            for n in ("acceleration", "pitch_rate")
        )
        lags = np.arange(EARLIEST, LATEST, SPACING)
        late = [
            np.column_stack([np.interp(self.time - lag, self.time, one) for lag in lags])
            for one in (push, np.gradient(rate, self.time))
        ]
        fixed = np.column_stack([np.ones(self.time.size), self.channels["speed"] ** 2, 1 - self.channels["rolling"]])
        return np.column_stack([fixed, late[0]]), np.column_stack([np.zeros_like(fixed), late[1]])

    @cached_property
    def _lagged_means(self) -> tuple[Array, Array]:
        at_antenna, per_lever = (self.integral @ each / self.width[:, None] for each in self._lagged)
        return at_antenna, per_lever


def cut_windows(log: Log, heading: float = 0.0) -> LoadWindows:
    """Cut a run into windows of some 20 ms (WINDOW) of an even number of intervals, weighted by Simpson's rule.

    Windows with a gap or a missing sample are left out.

    Parameters
    ----------
    log : as :func:`ready_runs` gives it. heading : +1 out, -1 back, 0 unknown.
    """
    names = [n for n in NOISY if n in log]
    channels = {n: log[n] for n in names}
    step = float(np.median(np.diff(log.time)))
    half = max(1, round(WINDOW / step / 2))
    first = np.arange(0, log.time.size - 2 * half, 2 * half)
    reach = first[:, None] + np.arange(2 * half + 1)
    gaps = np.diff(log.time[reach], axis=1)
    good = gaps.max(axis=1) < GAP * step
    for values in channels.values():
        good &= np.isfinite(values[reach]).all(axis=1)
    weights = _simpson(gaps[good])
    clean = {n: np.where(np.isfinite(v), v, 0.0) for n, v in (*channels.items(), ("pitch", pitch_angle(log)))}
    clean["speed"] = clean["speed"] if "speed" in clean else integrated_speed(log)
    clean["rolling"] = rolling_flag(clean["speed"], STANDSTILL if "speed" in log else UNCERTAIN_STANDSTILL)
    if "rear_load" not in log:
        clean |= dict(zip(HEAVES, pitch_heave(log.time, clean["pitch_rate"]), strict=True))
    noise = {n: _white_noise(log, n) for n in channels}
    return LoadWindows(log.name, log.time, heading, clean, weights, first[good].astype(np.int64), noise)


def _white_noise(log: Log, channel: str) -> float:
    """Standard deviation of the white noise that has the channel's spectrum at low frequencies.

    Interpolation between another logger's samples attenuates noise only at high frequencies: at half a sample the
    interpolated channel shows a third of it, and means of lines half. So the level is that of the samples; of an axle's
    load, of its wheels'.
    """
    recorded = {**log.averaged, **log.samples}
    own = {n: read for n, read in recorded.items() if np.isfinite(read[1]).sum() >= FEWEST_READINGS}
    wheels = WHEELS.get(channel, ())
    whole = channel in own or not any(n in own for n in wheels)
    read = [own.get(n, (log.time, log[n])) for n in ((channel,) if whole else wheels)]
    steps = [float(np.median(np.diff(time))) for time, _ in read]
    usual = float(np.median(np.diff(log.time)))
    squares = [white_level(v, t) ** 2 * step / usual for (t, v), step in zip(read, steps, strict=True)]
    return float(np.sqrt(sum(squares)))


def with_smaller_loads(log: Log, share: float) -> Log:
    """The log whose loads, of axles and wheels, read (1 + share) times too much, corrected."""
    loads = {*LOADS, *(n for wheels in WHEELS.values() for n in wheels)}
    gain = {n: 1 / (1 + share) if n in loads else 1.0 for n in {**log.channels, **log.samples, **log.averaged}}
    samples, averaged = ({n: (t, gain[n] * v) for n, (t, v) in kept.items()} for kept in (log.samples, log.averaged))
    return replace(log, channels={n: gain[n] * v for n, v in log.channels.items()}, samples=samples, averaged=averaged)


def pitch_angle(log: Log) -> Array:
    """Pitch (n,) relative to rest, rad; k times the acceleration where the integrated noise of the rate hides it.

    That noise is common to the pitch and its rate, and would look like a moment of the pitch. k as in
    :func:`integrated_pitch`.
    """
    pitch, slope = integrated_pitch(log)
    return pitch if exceeds_walk(log, pitch) else slope * (log["acceleration"] - np.nanmean(log["acceleration"]))


def exceeds_walk(log: Log, pitch: Array) -> bool:
    """Whether the pitch (n,), rad, exceeds ``WALK`` times the noise that its integration adds: level step (n / 6)^0.5.

    It is a random walk, which correlates with any slow channel by chance; (n / 6)^0.5 is its scatter about its mean.
    True for a logged pitch.
    """
    if "pitch" in log:
        return True
    rate = log["pitch_rate"]
    if np.count_nonzero(np.isfinite(rate)) < FEWEST_SAMPLES:
        return False
    walk = white_level(rate, log.time) * float(np.median(np.diff(log.time)) * np.sqrt(rate.size / 6))
    return float(np.nanstd(pitch)) > WALK * walk


def integrated_pitch(log: Log) -> tuple[Array, float]:
    """Pitch (n,) relative to rest, rad, from its channel or by integrating its rate; its slope k over acceleration.

    The zero of a gyro makes the integral drift. The drift c + b t is estimated by the fit th = c + b t + k a, because a
    sprung body pitches in proportion to the acceleration, and subtracted; a trend of the acceleration is preserved.
    """
    angle = (
        log["pitch"]
        if "pitch" in log
        else cumulative_integral(log.time, np.nan_to_num(log["pitch_rate"], posinf=0.0, neginf=0.0))
    )
    elapsed = log.time - log.time[0]
    trend = np.column_stack([np.ones_like(elapsed), elapsed, log["acceleration"]])
    good = np.isfinite(angle) & np.isfinite(trend).all(axis=1)
    kept = [0, 2] if "pitch" in log else [0, 1, 2]
    found = np.linalg.lstsq(trend[np.ix_(good, kept)], angle[good], rcond=None)[0]
    return np.asarray(angle - trend[:, kept[:-1]] @ found[:-1]), float(found[-1])


def integrated_speed(log: Log) -> Array:
    """Speed (n,) integrated from the acceleration, m/s; the lowest of the run is zero.

    A run that ends within ``SAME_SPEED`` of its start speed is assumed to end at that speed; the difference is due to
    the accelerometer's zero. The speed matters for the moment of the drag and for whether the wheels roll.
    """
    rate = np.where(np.isfinite(log["acceleration"]), log["acceleration"], 0.0)
    gained = cumulative_integral(log.time, rate)
    if abs(gained[-1]) < SAME_SPEED * float(np.ptp(gained)):
        gained = gained - gained[-1] * (log.time - log.time[0]) / log.duration
    return np.asarray(gained - gained.min())


def rolling_flag(speed: Array, standstill: float = STANDSTILL) -> Array:
    """1 where the wheels roll, 0 where they stand still, (n,), from the speed in m/s."""
    return np.where(np.abs(speed) < standstill, 0.0, 1.0)


def _derivatives(n: int, step: float, order: int) -> csr_array:
    """Matrix (n, n) of the derivatives over ``SPAN`` by the samples, except near both ends."""
    from scipy.sparse import diags_array

    half = derivative_reach(step, SPAN)
    impulse = np.zeros(6 * half + 1)
    impulse[3 * half] = 1.0
    response = local_derivative(impulse, step, SPAN, order)[2 * half : 4 * half + 1]
    return diags_array(np.tile(response[:, None], n), offsets=range(half, -half - 1, -1), shape=(n, n)).tocsr()


def _simpson(gaps: Array) -> Array:
    """Weights of Simpson's rule on uneven samples, (k, 2 j + 1) for gaps (k, 2 j)."""
    weights = np.zeros((len(gaps), gaps.shape[1] + 1))
    for j in range(0, gaps.shape[1], 2):
        a, b = gaps[:, j], gaps[:, j + 1]
        sixth = (a + b) / 6
        weights[:, j] += sixth * (2 - b / a)
        weights[:, j + 1] += sixth * (a + b) ** 2 / (a * b)
        weights[:, j + 2] += sixth * (2 - a / b)
    return weights
