"""Faults of loggers and sensors, put into the channels of a healthy log."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Place:
    """First sample of a fault, and the one after its last."""

    first: int
    stop: int


@dataclass(frozen=True)
class LogFault:
    """One kind of fault.

    Parameters
    ----------
    change : (channel (n,), place, generator) -> the faulty channel.
    lasts : it is a segment, not one sample. every : of all channels at once. half : from the place to the end.
    """

    change: Callable[[Array, Place, np.random.Generator], Array]
    lasts: bool = True
    every: bool = False
    half: bool = False


def faulty(
    channels: Mapping[str, Array], kind: str, channel: str, place: Place, rng: np.random.Generator
) -> dict[str, Array]:
    """The channels with a fault in one of them, or in all."""
    fault = FAULTS[kind]
    return {
        n: fault.change(np.array(v), place, rng) if n == channel or fault.every else np.array(v)
        for n, v in channels.items()
    }


def noise_level(values: Array) -> float:
    """Standard deviation of white noise, from second differences; the channel's motion adds to it."""
    return float(np.sqrt(np.mean(np.diff(values, 2) ** 2) / 6.0))


def resolution(values: Array) -> float:
    """The smallest step between any two values."""
    steps = np.diff(np.unique(values))
    steps = steps[steps > 1e-7 * np.abs(values).max(initial=0.0)]
    return float(steps.min()) if steps.size else 0.0


def _frozen(values: Array, at: Place, rng: np.random.Generator) -> Array:
    values[at.first : at.stop] = values[at.first]
    return values


def _line(values: Array, at: Place, rng: np.random.Generator) -> Array:
    """From the sample before to the one after, with the digits that the channel has."""
    step, ends = resolution(values), (values[at.first - 1], values[min(at.stop, values.size - 1)])
    line = np.linspace(*ends, at.stop - at.first + 2)[1:-1]
    values[at.first : at.stop] = np.round(line / step) * step if step > 0 else line
    return values


def _zero(values: Array, at: Place, rng: np.random.Generator) -> Array:
    values[at.first : at.stop] = 0.0
    return values


def _spike(values: Array, at: Place, rng: np.random.Generator) -> Array:
    values[at.first] += rng.choice([-1.0, 1.0]) * rng.uniform(10.0, 100.0) * noise_level(values)
    return values


def _gain(values: Array, at: Place, rng: np.random.Generator) -> Array:
    middle = values.size // 2
    values[middle:] *= 1.0 + rng.choice([-0.1, 0.1])
    return values


FAULTS: Mapping[str, LogFault] = {
    "spike": LogFault(_spike, lasts=False),
    "frozen channel": LogFault(_frozen),
    "frozen log": LogFault(_frozen, every=True),
    "straight line in a channel": LogFault(_line),
    "gap filled with straight lines": LogFault(_line, every=True),
    "dropout to zero": LogFault(_zero),
    "gain changes by 10 %": LogFault(_gain, lasts=False, half=True),
}
