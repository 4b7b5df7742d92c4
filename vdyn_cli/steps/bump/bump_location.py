"""Position of the bump in a log: a matched filter finds the response of a typical car in the axle loads."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.bump.crossing import CHANNELS, LOADS, traveled

LEAD, TAIL = 0.1, 0.6  # s of the response before the front axle meets the bump and after the rear axle has left it
REACH = 1.0  # s by which an axle's response may deviate from its expected time, in addition to the delay
NEARLY = 0.7  # share of the best score from which a position near the stated distance is preferred
# Share of a bump's score from which another bump is recognized. With one bump, other places have up to 0.05; an equal
# bump that is met while the car still oscillates has 0.35 or more.
ANOTHER = 0.2
CLOCKS = 0.2  # s by which clocks of two loggers may differ: the range of the candidate effect
NEAR = 0.25  # s about a time over which the speed is averaged
CREEPING = 0.1  # m/s, least speed of a response
SEARCH_ROUNDS, SAME_SPEED = 4, 0.02  # most rounds of the search, as the response depends on the speed; relative change


@dataclass(frozen=True)
class BumpLocation:
    """Position of the bump in a log, and how well a typical car's response fits the log there.

    Parameters
    ----------
    distance : m from the log's start to the bump's near edge, front axle.
    speed : mean speed from the front axle's meeting the bump to the rear axle's, m/s.
    correlation : of the loads with the response, 0 to 1.
    gain : of each channel, measured over simulated; 1 for the typical car. Body channels are shifted in time to match.
    delay : s from the front load's response to the rear load's, each located separately.
    alone : distances from the log's start, m, between which the car responds to no other bump; infinite without one.
    """

    distance: float
    speed: float
    correlation: float
    gain: Mapping[str, float]
    delay: float
    alone: tuple[float, float]


def find_bump(log: Log, simulator: Simulator, width: float, wheelbase: float, stated: float | None) -> BumpLocation:
    """Find the bump by a matched filter over the whole log.

    c(k) = sum y(k + i) x(i) / (|x| |y|), x the response of a typical car at the logged speed, y the changes of both
    loads. A car that slows down needs longer from one axle to the other, so that the response is simulated with the
    course of the speed after the place found before.

    The result is the position of the largest correlation, or one nearly as good within a wheelbase of the ``stated``
    distance.

    Parameters
    ----------
    log : with speed (m/s), front_load and rear_load (N). simulator : of the half car, without unknowns, its
        ``distance_front`` 0.
    width, wheelbase : m. stated : distance in the description, m; None where it states none.
    """
    way = traveled(log)
    step = float(np.median(np.diff(log.time)))
    clock = np.arange(log.time[0], log.time[-1] + step / 2, step)
    along = np.interp(clock, log.time, way)
    changes = {n: np.interp(clock, *_changes(log, n)) for n in CHANNELS if n in log}
    at = int(np.argmax(np.abs(changes["front_load"])))
    pace = _pace_from(log, clock[at : at + 1])
    for _ in range(SEARCH_ROUNDS):
        response = _response(simulator, pace, step, width + wheelbase)
        scores = np.array([_correlation(changes[n], response[n]) for n in LOADS])
        before, at = at, _best_place(scores.sum(axis=0), response, along, stated, wheelbase, round(LEAD / step))
        last, pace = pace, _pace_from(log, clock[max(at, 0) :])
        if at == before or np.ptp([*pace[: response["front_load"].size], *last]) < SAME_SPEED * pace[0]:
            break
    part = slice(max(at, 0), at + next(iter(response.values())).size)
    gain, correlation = _gains({n: c[part] for n, c in changes.items()}, response)
    gain |= {n: _shifted_gain(changes[n], response[n], at, step) for n in gain if n not in LOADS}
    meets = at + round(LEAD / step)
    distance = float(np.interp(clock[0] + meets * step, log.time, way))
    expected = _time_for(last, step, wheelbase)
    first = 1 - response["front_load"].size
    begins = along[np.clip(np.arange(scores.shape[1]) + first, 0, along.size - 1)]
    alone, apart = _alone(scores, at - first, begins, width + wheelbase)
    delay = _delay(changes, response, at, expected, step, min(round((REACH + expected) / step), apart // 2))
    return BumpLocation(distance, wheelbase / expected, correlation, gain, delay, alone)


def _alone(scores: Array, at: int, begins: Array, length: float) -> tuple[tuple[float, float], int]:
    """Distances, m, between which the car responds to no other bump, and the samples to the nearest other bump.

    Another bump has ``ANOTHER`` of the score of this one or more in both loads, and is met when the rear axle has left
    this one.

    Parameters
    ----------
    scores : (2, n), of each load and place. begins : (n,), distances, m, at which the responses begin.
    at : index of this bump. length : m, of the bump and the wheelbase.
    """
    another = scores.min(axis=0) > ANOTHER * scores[:, at].mean()
    others = np.flatnonzero(another & (np.abs(begins - begins[at]) > length))
    start = max((float(begins[k]) + length for k in others[others < at][-1:]), default=-np.inf)
    stop = min((float(begins[k]) for k in others[others > at][:1]), default=np.inf)
    return (start, stop), int(np.min(np.abs(others - at), initial=begins.size))


def _changes(log: Log, name: str) -> tuple[Array, Array]:
    """Times and values of a channel minus its median."""
    good = np.isfinite(log[name])
    values = log[name][good]
    return log.time[good], values - np.median(values)


def _pace_from(log: Log, clock: Array) -> Array:
    """Speed (n,) from the start of the response at the first of the times ``clock``, (n,), s, smoothed; m/s."""
    good = np.isfinite(log["speed"])
    time, speed = log.time[good], log["speed"][good]
    window = np.searchsorted(time, [clock - NEAR, clock + NEAR])
    total = np.append(0.0, np.cumsum(speed))
    count = np.maximum(window[1] - window[0], 1)
    mean = (total[window[1]] - total[window[0]]) / count
    return np.maximum(np.abs(np.where(window[1] > window[0], mean, np.interp(clock, time, speed))), CREEPING)


def _time_for(pace: Array, step: float, length: float) -> float:
    """Time after ``LEAD`` in which a car at this pace (n,), sampled every ``step`` s, covers ``length`` m."""
    after = pace[min(round(LEAD / step), pace.size - 1) :]
    way = np.append(0.0, np.cumsum(after * step))
    beyond = max(length - float(way[-1]), 0.0) / float(after[-1])
    return float(np.interp(length, way, step * np.arange(way.size))) + beyond


def _response(simulator: Simulator, pace: Array, step: float, length: float) -> dict[str, Array]:
    """Changes of all channels of a car that crosses a bump, sampled every ``step`` s.

    Parameters
    ----------
    pace : (n,), speed from ``LEAD`` s before the front axle meets the bump on, m/s; the last one holds from then on.
    length : m, of the bump and the wheelbase.
    """
    time = np.arange(0.0, LEAD + _time_for(pace, step, length) + TAIL, step)
    speed = pace[np.minimum(np.arange(time.size), pace.size - 1)]
    begin = float(np.sum(speed[: round(LEAD / step)])) * step
    drive = Drive(time, {"speed": speed, "elapsed": 0.0}, {"position": -begin})
    outputs = simulator(drive).outputs
    return {n: outputs[n] - outputs[n][0] for n in CHANNELS}


def _best_place(
    score: Array,
    response: Mapping[str, Array],
    along: Array,
    stated: float | None,
    near: float,
    lead: int,
) -> int:
    """Index of the sample at which the response begins; it may lie outside the log."""
    first = 1 - response["front_load"].size
    best = int(np.argmax(score))
    if stated is not None:
        places = np.arange(score.size) + first + lead
        close = np.abs(along[np.clip(places, 0, along.size - 1)] - stated) < near
        if close.any():
            nearby = int(np.flatnonzero(close)[np.argmax(score[close])])
            best = nearby if score[nearby] > NEARLY * score[best] else best
    return best + first


def _correlation(change: Array, response: Array) -> Array:
    """Sum of change x response for every shift; at the first, the response's last sample meets the log's first."""
    shifts = change.size + response.size - 1
    size = next_fast_len(shifts, real=True)
    return np.asarray(irfft(rfft(change, size) * rfft(response[::-1], size), size)[:shifts])


def _gains(changes: Mapping[str, Array], response: Mapping[str, Array]) -> tuple[dict[str, float], float]:
    """Gain of each channel over the response, and the correlation of both loads with it."""
    gain, product, measured, expected = {}, 0.0, 0.0, 0.0
    for name, change in changes.items():
        wanted = response[name][: change.size]
        own = change - np.mean(change)
        gain[name] = float(own @ wanted / max(float(wanted @ wanted), 1e-300))
        if name in LOADS:
            product += float(change @ wanted)
            measured += float(change @ change)
            expected += float(wanted @ wanted)
    return gain, product / max(np.sqrt(measured * expected), 1e-300)


def _shifted_gain(change: Array, response: Array, at: int, step: float) -> float:
    """Gain over the response at the best shift within CLOCKS.

    The body channels may come from a logger whose clock differs from that of the loads; at the best shift the gain
    has the sign of the channel.
    """
    score = _correlation(change, response)
    here, reach = at + response.size - 1, round(CLOCKS / step)
    near = score[max(here - reach, 0) : here + reach + 1]
    best = float(near[np.argmax(np.abs(near))]) if near.size else 0.0
    return best / max(float(response @ response), 1e-300)


def _delay(
    changes: Mapping[str, Array], response: Mapping[str, Array], at: int, expected: float, step: float, reach: int
) -> float:
    """Time from the front load's response to the rear load's, s, each located separately near ``at``.

    A wrong speed shifts both by the same time, so the difference is correct. ``reach``: samples by which each may lie
    away from ``at``, less than half the way to another bump.
    """
    places = []
    for name in LOADS:
        score = _correlation(changes[name], response[name])
        near = at + response[name].size - 1  # index of the score of the response that begins at ``at``
        first = max(near - reach, 0)
        places.append(first + int(np.argmax(score[first : near + reach + 1])))
    return expected + (places[1] - places[0]) * step
