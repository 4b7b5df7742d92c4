"""The end of coasts in which the drive pushes the car: creep of an electric or automatic car in gear.

The resistance of a car that rolls freely hardly changes below 15 km/h, and its air drag is known from higher speeds.
A deceleration that falls far below it at the lowest speeds, in the mean of both directions and in all runs alike, is a
drive. A slope has the opposite effect on the other direction.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, KeptAndRejected, RejectedSegment, kept_and_rejected
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

WIDTH = 0.7  # m/s of a class of speed, which a coast at 0.1 m/s^2 passes in 7 s
LOW, HIGH = 6, 24  # classes: below 15 km/h, and from there to 60 km/h, which give the deceleration without a drive
FEWEST_IN_CLASS = 5  # samples of a run in a class
LEAST_SPAN = 0.2  # m/s between the points of a run in a class; a speed in whole km/h has steps of 0.28 m/s
RETURNED = 0.9  # of the expected deceleration, from which on a class is no longer pushed


def without_creep(segments: Sequence[CoastSegment]) -> KeptAndRejected:
    """Coasts without their lowest speeds where a drive pushes the car, and those parts; needs both directions."""
    ways = [np.flatnonzero([s.direction == way for s in segments]) for way in ("out", "back")]
    if any(w.size < 2 for w in ways) or any(s.split for s in segments):
        return list(segments), []
    rates = np.array([_decelerations(s) for s in segments])
    edge = _free_from(rates, ways)
    if edge is None:
        return list(segments), []
    why = (
        f"all runs slow down less below {3.6 * edge:.0f} km/h than their rolling resistance explains: does the motor "
        "push (creep)?"
    )

    def above(one: CoastSegment) -> tuple[CoastSegment, list[RejectedSegment]]:
        time, slow = one.log.time, one.log["speed"] < edge
        begin = int(np.argmax(slow))
        if not slow.any() or begin < one.fewest:
            return one, []
        return one.rows(time < time[begin]), [RejectedSegment(one.name, float(time[begin]), float(time[-1]), why)]

    return kept_and_rejected(map(above, segments))


def _decelerations(segment: CoastSegment) -> Array:
    """Deceleration, (LOW + HIGH,) m/s^2, of a run in each class of speed without the known accelerations; NaN: none.

    The slope of a line through the points halfway between successive samples that differ. Of a speed in steps of the
    class's width over n, a line through all samples has the slope times 1 - 1/n^2.
    """
    time, speed = segment.log.time, segment.log["speed"]
    lowest = np.minimum.accumulate(speed)
    change = np.flatnonzero(np.diff(speed)) + 1
    at, halfway = 0.5 * (time[change - 1] + time[change]), 0.5 * (speed[change - 1] + speed[change])
    found = np.full(LOW + HIGH, np.nan)
    for k in range(found.size):
        inside = (lowest >= k * WIDTH) & (lowest < (k + 1) * WIDTH)
        crossed = inside[change]
        if inside.sum() >= FEWEST_IN_CLASS and crossed.any() and np.ptp(halfway[crossed]) > LEAST_SPAN:
            rate = np.polyfit(at[crossed], halfway[crossed], 1)[0]
            found[k] = float(np.mean(segment.pushed[inside])) - float(rate)
    return found


def _free_from(rates: Array, ways: Sequence[NDArray[np.intp]]) -> float | None:
    """The speed, m/s, from which on the runs (r, c) roll freely; None where they do so at all speeds."""
    each = [rates[w] for w in ways]
    seen = np.all([np.isfinite(e).sum(axis=0) >= 2 for e in each], axis=0)
    above = np.flatnonzero(seen & (np.arange(seen.size) >= LOW))
    if not seen[:LOW].any() or above.size < 2:
        return None
    means, errors = np.full(seen.size, np.nan), np.full(seen.size, np.nan)
    for k in np.flatnonzero(seen):
        mine = [e[np.isfinite(e[:, k]), k] for e in each]
        means[k] = np.mean([m.mean() for m in mine])
        errors[k] = 0.5 * np.sqrt(sum(m.var(ddof=1) / m.size for m in mine))
    center = (np.arange(seen.size) + 0.5) * WIDTH
    line = np.polyfit(center[above] ** 2, means[above], 1)
    expected = np.polyval(line, center**2)
    lowest = int(np.argmax(seen))
    missing = expected[lowest] - means[lowest]
    if missing < max(COASTDOWN_POLICY.creep_share * expected[lowest], COASTDOWN_POLICY.creep_std * errors[lowest]):
        return None
    returned = np.flatnonzero(seen & (means >= RETURNED * expected))
    return float(WIDTH * (returned[0] + 1 if returned.size else LOW))  # the first one may still be pushed in part
