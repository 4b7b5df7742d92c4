"""Coast-down times between two speeds, and the statistical accuracy that the standards require.

Opposite runs make a pair; a pair counts with the mean of its two decelerations, the harmonic mean of its two times.
Over n pairs with mean T and standard deviation s::

    p = t s / (sqrt(n) T)

with t = 3.2 ... 2.2 and p <= 2 % in UN Regulation 83 (70/220/EEC), t = 4.3 ... 2.3 and p <= 3 % in WLTP (UN GTR 15).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.steps.coastdown.segments import CoastSegment

Array = NDArray[np.float64]

R83 = {4: 3.2, 5: 2.8, 6: 2.6, 7: 2.5, 8: 2.4, 9: 2.3} | dict.fromkeys(range(10, 16), 2.2)
WLTP = {3: 4.3, 4: 3.2, 5: 2.8, 6: 2.6, 7: 2.5, 8: 2.4, 9: 2.3, 10: 2.3}
R83_LIMIT, WLTP_LIMIT = 0.02, 0.03
HALF_STEP = 5 / 3.6  # m/s to either side of a reference speed
REFERENCE_STEP = 10 / 3.6  # m/s between reference speeds
SMOOTH = 0.5  # s, over which the speed is averaged before it is interpolated


@dataclass(frozen=True)
class CoastTimes:
    """The times of all pairs about one reference speed.

    Parameters
    ----------
    speed, upper, lower : m/s. pairs : (n,) s, harmonic mean time of each pair.
    r83, wltp : statistical accuracy; None where the standard requires more pairs.
    """

    speed: float
    upper: float
    lower: float
    pairs: Array
    r83: float | None
    wltp: float | None

    @property
    def mean(self) -> float:
        """Harmonic mean of the pairs' times, s: the time of the mean deceleration."""
        return float(1.0 / np.mean(1.0 / self.pairs))

    def force(self, inertia: float) -> float:
        """Road load that this time means, N, for an inertia in kg."""
        return inertia * (self.upper - self.lower) / self.mean

    def force_error(self, inertia: float) -> float:
        """Half the 95 % interval of that force from the scatter of the pairs, N; 0 for one pair."""
        n = self.pairs.size
        if n < 2:
            return 0.0
        half = t_quantile(float(n - 1)) * float(np.std(1.0 / self.pairs, ddof=1)) / np.sqrt(n)
        return float(inertia * (self.upper - self.lower) * half)


def paired_runs(segments: Sequence[CoastSegment], directions: Sequence[str | None]) -> list[tuple[int, int]]:
    """The k-th run out with the k-th run back, as indices."""
    out = [k for k, s in enumerate(segments) if directions[s.run] == "out"]
    back = [k for k, s in enumerate(segments) if directions[s.run] == "back"]
    return list(zip(out, back, strict=False))


def coast_times(segments: Sequence[CoastSegment], directions: Sequence[str | None]) -> list[CoastTimes]:
    """Times about every 10 km/h that all paired runs pass, highest first; none without runs in both directions."""
    couples = paired_runs(segments, directions)
    if not couples:
        return []
    falls = [_falling_speed(s) for s in segments]
    used = [falls[k] for couple in couples for k in couple]
    top, bottom = min(t[1].max() for t in used), max(t[1].min() for t in used)
    first, last = np.floor((top - HALF_STEP) / REFERENCE_STEP), np.ceil((bottom + HALF_STEP) / REFERENCE_STEP)
    found = []
    for step in np.arange(first, last - 0.5, -1.0):
        speed = float(step) * REFERENCE_STEP
        times = np.array([[_between(falls[k], speed) for k in couple] for couple in couples])
        found.append(_with_accuracy(speed, 2.0 / np.sum(1.0 / times, axis=1)))
    return found


def _with_accuracy(speed: float, times: Array) -> CoastTimes:
    n = times.size
    spread = float(np.std(times, ddof=1) / np.sqrt(n) / np.mean(times)) if n > 1 else np.nan
    factors = (table.get(min(n, max(table))) if n >= min(table) else None for table in (R83, WLTP))
    r83, wltp = (None if t is None else t * spread for t in factors)
    return CoastTimes(speed, speed + HALF_STEP, speed - HALF_STEP, times, r83, wltp)


def _falling_speed(segment: CoastSegment) -> tuple[Array, Array]:
    bins = cut(segment.log.time, SMOOTH)
    return bins.time, np.minimum.accumulate(bins.mean(segment.log["speed"]))


def _between(fall: tuple[Array, Array], speed: float) -> float:
    time, falling = fall
    upper, lower = (float(np.interp(-v, -falling, time)) for v in (speed + HALF_STEP, speed - HALF_STEP))
    return lower - upper
