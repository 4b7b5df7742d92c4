"""The driving regime of every sample: launch, acceleration, cruise, coast, braking, or low speed."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.bins import cut
from vdyn_cli.quantities.arrays import Array, filled

Marks = NDArray[np.int64]

REGIMES = ("launch", "acceleration", "cruise", "coast", "braking", "low speed")
SLOW = 3.0  # m/s, below which the car is almost at rest
STARTING = 0.3  # m/s, below which the car is at rest, or has just begun to move
LAUNCHED = 6.0  # m/s, at which a start from rest is over
STEADY = 0.3  # m/s^2, limit between cruising and accelerating
PRESSED = 0.02  # share of the largest brake torque above which the brake is on
# Standard deviations of the brake channel's noise that a pressed brake exceeds: one sample of 10^6 of normal noise.
BEYOND_NOISE = 5.0
NOISE_BLOCK = 8  # samples, or one second if that is more, in which the noise of the brake channel is estimated
THIRD_DIFFERENCE = 20.0  # variance of a third difference of white noise over that of the noise
ONE_SIDED = 1.71  # standard deviation of normal noise over that of its positive part: (1/2 - 1/(2 pi))^-0.5
IDLE = 0.03  # share of the largest drive torque below which the pedal is released
SMOOTH = 1.0  # s over which the acceleration is averaged
RESTING = 0.1  # m/s
CREEPING = 1.0  # m/s, below which a car that slows down is about to stop
SETTLED = 1.0  # s after which a stopped car has come to rest on its tires
HARD = 0.8  # m/s^2, deceleration without drive that exceeds any road load: a brake is on


def marked(time: Array, speed: Array, drive: Array, brake: Array) -> Marks:
    """The regime of every sample, (n,), as an index into REGIMES.

    A start from rest is a launch until 6 m/s; other samples below 3 m/s are low speed.

    Parameters
    ----------
    time : (n,) s. speed : (n,) m/s, may contain NaN. drive, brake : (n,) N m.
    """
    speed = filled(time, speed)
    rate = _rate(time, speed)
    driven = drive > IDLE * max(float(np.max(np.abs(drive))), 1e-9)
    braked = pressed(time, brake) if brake.any() else (rate < -HARD) & ~driven
    marks = np.where(driven, np.where(np.abs(rate) > STEADY, 1, 2), 3)
    marks = np.where(braked, 4, marks)
    marks = np.where((speed < SLOW) & ~driven, 5, marks)
    marks = np.where((speed < SLOW) & braked & (rate > -STEADY), 5, marks)
    return np.where(_launching(speed, driven), 0, marks).astype(np.int64)


def pressed(time: Array, brake: Array) -> NDArray[np.bool_]:
    """Samples at which a brake is on: |T| > max(0.02 max |T|, 5 standard deviations of the channel's white noise).

    The noise is the median over short blocks, most of which are without braking; loggers often clip it at zero.

    Parameters
    ----------
    time : (n,) s. brake : (n,) N m, of any sign.

    Returns
    -------
    (n,) mask; all False where the channel contains only noise.
    """
    size = np.abs(brake)
    return np.asarray(size > max(PRESSED * float(size.max()), BEYOND_NOISE * _brake_noise(time, brake)))


def _brake_noise(time: Array, brake: Array) -> float:
    """Standard deviation of the brake channel's white noise, from third differences within blocks."""
    length = NOISE_BLOCK
    if time.size > 1:
        length = max(length, int(1.0 / float(np.median(np.diff(time)))))
    differences = np.diff(brake, 3)
    count = differences.size // length
    if not count:
        return 0.0
    squares = np.mean(differences[: count * length].reshape(count, length) ** 2, axis=1) / THIRD_DIFFERENCE
    clipped = float(np.median(np.abs(brake))) == float(np.min(np.abs(brake)))
    return (ONE_SIDED if clipped else 1.0) * float(np.sqrt(np.median(squares)))


def _launching(speed: Array, driven: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Mask (n,) of launches: from the last moment below ``STARTING`` to 6 m/s, while driven."""
    launching, found = False, np.zeros(speed.size, dtype=bool)
    for i, (v, on) in enumerate(zip(speed.tolist(), driven.tolist(), strict=True)):
        if not on or v > LAUNCHED:
            launching = False
        elif v < STARTING:
            launching = True
        found[i] = launching
    return found


def _rate(time: Array, speed: Array) -> Array:
    """Acceleration (n,) averaged over ``SMOOTH``, m/s^2."""
    later = np.interp(time + SMOOTH / 2, time, speed)
    earlier = np.interp(time - SMOOTH / 2, time, speed)
    span = np.minimum(time + SMOOTH / 2, time[-1]) - np.maximum(time - SMOOTH / 2, time[0])
    return np.asarray((later - earlier) / np.maximum(span, 1e-9))


def stops(time: Array, speed: Array) -> NDArray[np.bool_]:
    """Samples from 1 m/s down to rest, and the second in which the car settles.

    Parameters
    ----------
    time : (n,) s. speed : (n,) m/s, NaN where it is missing.

    Returns
    -------
    (n,) mask.
    """
    smooth = smoothed(time, speed)
    found = np.zeros(time.size, dtype=bool)
    rest = smooth < RESTING
    for i in np.flatnonzero(rest[1:] & ~rest[:-1]) + 1:
        faster = np.flatnonzero(smooth[:i] > CREEPING)
        if faster.size:
            found |= (time >= time[faster[-1]]) & (time <= time[i] + SETTLED)
    return found


def smoothed(time: Array, speed: Array) -> Array:
    """The speed averaged over 0.1 s, interpolated over gaps.

    Parameters
    ----------
    time : (n,) s. speed : (n,) m/s, NaN where it is missing.

    Returns
    -------
    (n,) m/s.
    """
    bins = cut(time, 0.1)
    return np.asarray(np.interp(time, bins.time, bins.mean(filled(time, speed))))
