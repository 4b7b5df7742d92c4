"""Coast-down times between two speeds, and the statistical accuracy that standards ask of them.

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
from vdyn_cli.steps.coastdown.selection import Stretch

Array = NDArray[np.float64]

R83 = {4: 3.2, 5: 2.8, 6: 2.6, 7: 2.5, 8: 2.4, 9: 2.3} | dict.fromkeys(range(10, 16), 2.2)
WLTP = {3: 4.3, 4: 3.2, 5: 2.8, 6: 2.6, 7: 2.5, 8: 2.4, 9: 2.3, 10: 2.3}
R83_LIMIT, WLTP_LIMIT = 0.02, 0.03
HALF_STEP = 5 / 3.6  # m/s to either side of a reference speed
REFERENCE_STEP = 10 / 3.6  # m/s between reference speeds
SMOOTH = 0.5  # s, over which the speed is averaged before it is looked up


@dataclass(frozen=True)
class Timed:
    """One reference speed: m/s, s of each pair, and the accuracies, None where a standard wants more pairs."""

    speed: float
    upper: float
    lower: float
    pairs: Array
    r83: float | None
    wltp: float | None

    @property
    def mean(self) -> float:
        """Harmonic mean of the pairs' times, s: that of the mean deceleration."""
        return float(1.0 / np.mean(1.0 / self.pairs))

    def force(self, inertia: float) -> float:
        """Road load, N, that this time means for an inertia in kg."""
        return inertia * (self.upper - self.lower) / self.mean


def pairs(stretches: Sequence[Stretch], directions: Sequence[str | None]) -> list[tuple[int, int]]:
    """The k-th run out with the k-th run back, as indices."""
    out = [k for k, s in enumerate(stretches) if directions[s.run] == "out"]
    back = [k for k, s in enumerate(stretches) if directions[s.run] == "back"]
    return list(zip(out, back, strict=False))


def timed(stretches: Sequence[Stretch], directions: Sequence[str | None]) -> list[Timed]:
    """Times about every 10 km/h that all paired runs pass, from the highest down."""
    couples = pairs(stretches, directions)
    if not couples:
        return []
    traces = [_trace(s) for s in stretches]
    used = [traces[k] for couple in couples for k in couple]
    top, bottom = min(t[1].max() for t in used), max(t[1].min() for t in used)
    first, last = np.floor((top - HALF_STEP) / REFERENCE_STEP), np.ceil((bottom + HALF_STEP) / REFERENCE_STEP)
    found = []
    for step in np.arange(first, last - 0.5, -1.0):
        speed = float(step) * REFERENCE_STEP
        times = np.array([[_between(traces[k], speed) for k in couple] for couple in couples])
        found.append(_judged(speed, 2.0 / np.sum(1.0 / times, axis=1)))
    return found


def _judged(speed: float, times: Array) -> Timed:
    n = times.size
    spread = float(np.std(times, ddof=1) / np.sqrt(n) / np.mean(times)) if n > 1 else np.nan
    factors = (table.get(min(n, max(table))) if n >= min(table) else None for table in (R83, WLTP))
    r83, wltp = (None if t is None else t * spread for t in factors)
    return Timed(speed, speed + HALF_STEP, speed - HALF_STEP, times, r83, wltp)


def _trace(stretch: Stretch) -> tuple[Array, Array]:
    bins = cut(stretch.log.time, SMOOTH)
    return bins.time, np.minimum.accumulate(bins.mean(stretch.log["speed"]))


def _between(trace: tuple[Array, Array], speed: float) -> float:
    time, falling = trace
    upper, lower = (float(np.interp(-v, -falling, time)) for v in (speed + HALF_STEP, speed - HALF_STEP))
    return lower - upper
