"""Noise of torque and acceleration that is correlated between samples: it exceeds that of the samples in windows."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.inference.robust_fits import huber_fit
from vdyn_cli.quantities.arrays import Array, median_deviation
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.inertia.moment_balance import DriveWindows, drive_windows, impulses
from vdyn_cli.steps.sign_conventions import cosine

THIRD_OF_DIFFERENCES = 3.5  # var(d3 (w_k+1 - w_k)) / 20 of white noise w: 70 / 20
SHARED = -1.5  # var(d3 w) / 20 by the covariance of adjacent w: 2 (-3 - 9 - 3) / 20
# Least relative excess of the variance over that of the samples' noise, in units of (2 / n)^0.5: two standard errors of
# a variance from the median of overlapping third differences.
LEAST_EXCESS = 5.0
WINDOWS = (0.125, 0.25, 0.5, 1.0)  # s of integration: a clock offset shows where torque and speed change fast
FEWEST_WINDOWS = 16  # windows of a run
HUB = ("hub_torque", "hub_force_x", "hub_force_z")  # channels with one clock
DELAYS = tuple(np.arange(-20, 21) / 100)  # s, of the hub's channels: the range of clock_offset
TINY = 1e-12  # (rad/s)^2
# s: ten times the largest clock offset, so that late readings of forces matter little.
BLOCK = 1.0
ROWS_PER_UNKNOWN = 5  # at least, so that the median residual is one of noise


def with_shared_noise(runs: Sequence[DriveWindows]) -> tuple[DriveWindows, ...]:
    """The runs with one level of the samples' noise, the root mean square of theirs: they have the same sensors."""
    levels = np.array([(run.noise.torque, run.noise.acceleration, run.noise.speed) for run in runs])
    torque, acceleration, speed = np.sqrt(np.mean(levels**2, axis=0)).tolist()
    return tuple(
        replace(run, noise=replace(run.noise, torque=torque, acceleration=acceleration, speed=speed)) for run in runs
    )


def with_scatter(runs: Sequence[DriveWindows], wheel: Mapping[str, float]) -> tuple[DriveWindows, ...]:
    """The runs with the noise of their torque estimated from the scatter of impulses, where that is larger.

    Torque and forces of a rolling wheel have noise that is correlated between samples: the tire is uneven, the road
    rough, the amplifiers have filters. Third differences of

        e = impulse - J gained,    var(d3 e) / 20 = f^2 S_T + (m r)^2 S_a + 3.5 J^2 speed^2,

    suppress slow changes, such as most model errors; J is estimated from them, and their median suppresses pedal steps.
    S_T and S_a are the variances by the white noise of the samples of torque and acceleration, m r is the wheel's mass
    times radius, and f one factor for all runs, which have the same sensors. If the torque's noise were underestimated
    relative to the speed's, the inertia would be biased high (total least squares). Each run has the delay of its hub's
    channels at which impulse and speed gained correlate most.

    Parameters
    ----------
    wheel : wheel_mass (kg), wheel_radius (m), rolling_resistance; empty for a free wheel.
    """
    moment = wheel.get("wheel_mass", 0.0) * wheel.get("wheel_radius", 0.0)
    whitened: list[Array] = []
    of_torque: list[float] = []
    for run in runs:
        if run.first.size < FEWEST_WINDOWS or not np.isfinite(impulses(run, wheel)).all():
            continue
        weights = float(np.median(run.noise.squares)) + SHARED * float(np.median(run.noise.shared))
        sampled = run.noise.torque**2 * weights
        change, torque = np.diff(run.gained, 3), impulses(run, wheel, likeliest_delay(run, wheel))
        inertia = float(change @ np.diff(torque, 3) / max(float(change @ change), TINY))
        of_car = (moment * run.noise.acceleration) ** 2 * weights
        usual = sampled + of_car + THIRD_OF_DIFFERENCES * (inertia * run.noise.speed) ** 2
        whitened.append((torque - inertia * run.gained) / usual**0.5)
        of_torque.append(sampled / usual)
    count = sum(e.size for e in whitened)
    excess = white_level(np.concatenate(whitened)) ** 2 - 1.0 if whitened else 0.0
    if not excess > LEAST_EXCESS * (2.0 / max(count, 1)) ** 0.5:
        return tuple(runs)
    factor = float((1.0 + excess / np.mean(of_torque)) ** 0.5)
    return tuple(replace(run, noise=replace(run.noise, torque=factor * run.noise.torque)) for run in runs)


def likeliest_delay(run: DriveWindows, wheel: Mapping[str, float]) -> float:
    """Delay of the hub's channels, s: of ``DELAYS``, that with the largest correlation of impulse and speed gained.

    The correlation is that of their third differences. 0 for a run with fewer than ``FEWEST_WINDOWS``.
    """
    if run.first.size < FEWEST_WINDOWS:
        return 0.0
    change = np.diff(run.gained, 3)
    return float(max(DELAYS, key=lambda delay: cosine(change, np.diff(impulses(run, wheel, delay), 3))))


def aligned(logs: Sequence[Log], runs: Sequence[DriveWindows], wheel: Mapping[str, float]) -> list[Log]:
    """The logs with the hub's channels read later by the likeliest delay of each run: as noise, it would hide itself.

    Parameters
    ----------
    runs : windows of the logs. wheel : as of :func:`drive_windows`.
    """
    later = [log.time + likeliest_delay(run, wheel) for log, run in zip(logs, runs, strict=True)]
    return [
        log.with_channels(**{name: np.interp(time, log.time, log[name]) for name in HUB})
        for log, time in zip(logs, later, strict=True)
    ]


def with_slow_acceleration(
    runs: Sequence[DriveWindows], logs: Sequence[Log], wheel: Mapping[str, float]
) -> tuple[DriveWindows, ...]:
    """The runs with the accelerometer's noise estimated over blocks of a second, where it exceeds white noise.

    The car pitches and the road is rough, so errors of an accelerometer last longer than a sample. Its integral v
    differs from the speed gained by the wheel by the tire's slip, a function of the ratio phi of longitudinal force to
    load:

        r gained = c v + b duration + change of r om (k phi + h phi |phi|) + e,    var e = 2 (r speed)^2 + var a

    with c, k, h shared and b of each run; ``var a`` is the variance beyond the white noise of both readings. Fit and
    median are insensitive to slips that deviate from this law, as those of a wheel near the limit of its adhesion do:
    least squares spreads them over all blocks, and a large mass then explains any residual by that noise.

    Parameters
    ----------
    logs : from which the runs were cut. wheel : wheel_mass (kg), wheel_radius (m), rolling_resistance.

    Source: Fuller, Measurement Error Models (Wiley 1987), 2.2: the bias due to noise of a regressor; Huber (1964).
    """
    blocks = [drive_windows(log, BLOCK, wheel) for log in aligned(logs, runs, wheel)]
    radius, count = wheel["wheel_radius"], sum(b.first.size for b in blocks)
    shared = [np.column_stack([b.integral(b.log["acceleration"]), *_slips(b, wheel), b.duration]) for b in blocks]
    *law, duration = np.concatenate(shared).T
    own = np.eye(len(blocks)).repeat([b.first.size for b in blocks], axis=0) * duration[:, None]
    matrix, right = np.column_stack([*law, own]), radius * np.concatenate([b.gained for b in blocks])
    if count < ROWS_PER_UNKNOWN * matrix.shape[1]:
        return tuple(runs)
    left = right - matrix @ huber_fit(matrix, right)[0]
    white = np.concatenate(
        [2.0 * (radius * b.noise.speed) ** 2 + b.noise.acceleration**2 * b.noise.squares for b in blocks]
    )
    shown = median_deviation(left) ** 2 * count / (count - matrix.shape[1])
    slow = max(shown - float(np.median(white)), 0.0) / BLOCK**2  # (m/s^2)^2
    return tuple(replace(run, noise=replace(run.noise, slow=slow * run.duration**2)) for run in runs)


def _slips(block: DriveWindows, wheel: Mapping[str, float]) -> tuple[Array, Array]:
    """Change over each block of r om phi and r om phi |phi|, (w,) m/s."""
    log, weight = block.log, wheel["wheel_mass"] * GRAVITY
    share = log["hub_force_x"] / np.maximum(log["hub_force_z"] + weight, weight)
    linear = wheel["wheel_radius"] * log["wheel_speed"] * share
    return block.change(linear), block.change(linear * np.abs(share))


def long_enough(logs: Sequence[Log], runs: Sequence[DriveWindows], wheel: Mapping[str, float], most: float) -> float:
    """The shortest of ``WINDOWS``, s, in which the wheel's speed separates inertia from radius and mass.

    The wheel's acceleration is nearly proportional to that of the car, which acts on radius and mass. Only the rest of
    the speed gained, by the tire's slip, discriminates between them. With a share n of noise in the variance of that
    rest, an error x of the ratio of the noises' variances biases the inertia by x n / (1 - n).

    Parameters
    ----------
    logs, runs, wheel : as of :func:`aligned`. most : the share n that is allowed; the last where none keeps it.
    """
    logs = aligned(logs, runs, wheel)
    for width in WINDOWS:
        left = noise = 0.0
        for run in (drive_windows(log, width, wheel) for log in logs):
            columns = [run.integral(run.log[name]) for name in ("hub_force_x", "acceleration", "hub_force_z")]
            matrix = np.column_stack([*columns, run.duration])
            if run.first.size > ROWS_PER_UNKNOWN * matrix.shape[1]:
                rest = run.gained - matrix @ np.linalg.lstsq(matrix, run.gained)[0]
                left += float(rest @ rest)
                noise += 2.0 * run.noise.speed**2 * (rest.size - matrix.shape[1])
        if noise < most * left:
            return width
    return WINDOWS[-1]
