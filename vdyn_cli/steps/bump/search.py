"""Where in a log the bump is: a typical car's answer to it is looked for in the axle loads, at every moment."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.bump.crossing import CHANNELS, LOADS, travelled

Array = NDArray[np.float64]

LEAD, TAIL = 0.1, 0.6  # s of the answer before the front axle meets the bump and after the rear axle has left it
APART = 1.0  # s by which an axle's change may lie elsewhere than expected, beyond the delay itself
NEARBY = 0.7  # of the best likeness: as good a place nearer to where the bump is said to be is preferred


@dataclass(frozen=True)
class Found:
    """Where the bump was found, and how alike the log and a typical car's answer are there.

    Parameters
    ----------
    distance : m from the log's start to the bump's near edge, front axle.
    speed : m/s there.
    likeness : correlation of the loads with the answer, 0 to 1.
    gain : of each channel, measured over simulated; 1 were the car the typical one.
    delay : s from the front load's change to the rear load's, each found by itself.
    """

    distance: float
    speed: float
    likeness: float
    gain: Mapping[str, float]
    delay: float


def find_bump(log: Log, simulator: Simulator, width: float, wheelbase: float, told: float | None) -> Found:
    """Look for the bump by a matched filter over the whole log.

    The answer of a car of typical parameters at the log's own speed is correlated with both loads' changes; the place
    of the largest correlation is taken, or one nearly as good within a wheelbase of where the bump is ``told`` to be.

    Parameters
    ----------
    simulator : of the half car, without unknowns, its ``distance_front`` 0.
    """
    way = travelled(log)
    step = float(np.median(np.diff(log.time)))
    clock = np.arange(log.time[0], log.time[-1] + step / 2, step)
    along = np.interp(clock, log.time, way)
    changes = {n: np.interp(clock, *_changes(log, n)) for n in CHANNELS if n in log}
    at = int(np.argmax(np.abs(changes["front_load"])))
    for _ in range(3):
        speed = _speed_near(log, float(clock[at]))
        answer = _answer(simulator, speed, step, width + wheelbase)
        before, at = at, _best_place(changes, answer, along, told, wheelbase, round(LEAD / step))
        if abs(_speed_near(log, float(clock[at])) - speed) < 0.02 * speed or at == before:
            break
    part = slice(max(at, 0), at + next(iter(answer.values())).size)
    gain, likeness = _alike({n: c[part] for n, c in changes.items()}, answer)
    meets = at + round(LEAD / step)
    distance = float(np.interp(clock[0] + meets * step, log.time, way))
    return Found(distance, speed, likeness, gain, _delay(changes, answer, at, wheelbase / speed, step))


def _changes(log: Log, name: str) -> tuple[Array, Array]:
    """Times and values of a channel, less its usual value."""
    good = np.isfinite(log[name])
    values = log[name][good]
    return log.time[good], values - np.median(values)


def _speed_near(log: Log, time: float) -> float:
    near = np.abs(log.time - time) < 0.25
    values = log["speed"][near] if np.isfinite(log["speed"][near]).any() else log["speed"]
    return float(np.nanmean(values))


def _answer(simulator: Simulator, speed: float, step: float, length: float) -> dict[str, Array]:
    """Changes of all channels as a car at constant speed crosses the bump, sampled each ``step``."""
    pace = max(abs(speed), 0.1)
    time = np.arange(0.0, LEAD + length / pace + TAIL, step)
    drive = Drive(time, {"speed": pace, "elapsed": 0.0}, {"position": -pace * LEAD})
    outputs = simulator(drive).outputs
    return {n: outputs[n] - outputs[n][0] for n in CHANNELS}


def _best_place(
    changes: Mapping[str, Array], answer: Mapping[str, Array], along: Array, told: float | None, near: float, lead: int
) -> int:
    """Index of the sample at which the answer begins; it may hang over the log's ends."""
    score: Array = np.sum([_correlation(changes[n], answer[n]) for n in LOADS], axis=0)
    first = 1 - answer["front_load"].size
    best = int(np.argmax(score))
    if told is not None:
        places = np.arange(score.size) + first + lead
        close = np.abs(along[np.clip(places, 0, along.size - 1)] - told) < near
        if close.any():
            nearby = int(np.flatnonzero(close)[np.argmax(score[close])])
            best = nearby if score[nearby] > NEARBY * score[best] else best
    return best + first


def _correlation(change: Array, answer: Array) -> Array:
    """Sum of change x answer for every place of the answer, from its last sample at the log's first one on."""
    size = change.size + answer.size - 1
    padded = 1 << (size - 1).bit_length()
    product = np.fft.rfft(change, padded) * np.fft.rfft(answer[::-1], padded)
    return np.asarray(np.fft.irfft(product, padded)[:size])


def _alike(changes: Mapping[str, Array], answer: Mapping[str, Array]) -> tuple[dict[str, float], float]:
    """Gain of each channel against the answer, and the correlation of both loads with it."""
    gain, product, measured, expected = {}, 0.0, 0.0, 0.0
    for name, change in changes.items():
        wanted = answer[name][: change.size]
        own = change - np.mean(change)
        gain[name] = float(own @ wanted / max(float(wanted @ wanted), 1e-300))
        if name in LOADS:
            product += float(change @ wanted)
            measured += float(change @ change)
            expected += float(wanted @ wanted)
    return gain, product / max(np.sqrt(measured * expected), 1e-300)


def _delay(changes: Mapping[str, Array], answer: Mapping[str, Array], at: int, expected: float, step: float) -> float:
    """Time from the front load's change to the rear load's, s, each looked for by itself near ``at``.

    Both answers are misplaced alike where the speed is wrong, so that the difference is not.
    """
    reach = round((APART + expected) / step)
    places = []
    for name in LOADS:
        score = _correlation(changes[name], answer[name])
        near = at + answer[name].size - 1  # where the score of the answer that begins at ``at`` stands
        first = max(near - reach, 0)
        places.append(first + int(np.argmax(score[first : near + reach + 1])))
    return expected + (places[1] - places[0]) * step
