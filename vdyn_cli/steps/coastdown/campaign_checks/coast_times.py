"""Coast-down times between two speeds, and the statistical accuracy that the standards require.

Opposite runs make a pair; a pair counts with the mean of its two decelerations, the harmonic mean of its two times.
Over n pairs with mean T and standard deviation s::

    p = t s / (sqrt(n) T)

with p <= 2 % over at least four pairs in UN Regulation 83 (70/220/EEC) and p <= 3 % over at least three in WLTP (UN GTR
15). Both tabulate t rounded to one decimal; here t is the exact 97.5 % quantile of Student's t with n - 1 degrees of
freedom (2.26 for ten pairs, where Regulation 83 prints 2.2 and WLTP 2.3).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.description.description_model import Run
from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment

R83_PAIRS, WLTP_PAIRS = 4, 3  # fewest pairs
R83_LIMIT, WLTP_LIMIT = 0.02, 0.03  # statistical accuracy p of the mean time
HALF_STEP = 5 / 3.6  # m/s to either side of a reference speed
REFERENCE_STEP = 10 / 3.6  # m/s between reference speeds
SMOOTH = 0.5  # s, over which the speed is averaged before it is interpolated


@dataclass(frozen=True)
class CoastTimes:
    """Coast-down times of all pairs of runs about one reference speed.

    Parameters
    ----------
    speed : m/s, in the middle of the interval. pairs : (n,) s, harmonic mean time of each pair.
    r83, wltp : statistical accuracy; None where the standard requires more pairs.
    """

    speed: float
    pairs: Array
    r83: float | None
    wltp: float | None

    @property
    def mean(self) -> float:
        """Harmonic mean of the pairs' times, s: the time of the mean deceleration."""
        return float(1.0 / np.mean(1.0 / self.pairs))

    def force(self, inertia: float) -> float:
        """Road load from the mean time, N, for an inertia in kg: inertia dV / mean, dV the interval of speed."""
        return inertia * 2.0 * HALF_STEP / self.mean

    def force_error(self, inertia: float) -> float:
        """Half the 95 % interval of that force, N; 0 for one pair.

        inertia dV t sd(1 / pairs) / sqrt(n), t the 97.5 % quantile of Student's t with n - 1 degrees
        """
        n = self.pairs.size
        if n < 2:
            return 0.0
        half = t_quantile(float(n - 1)) * float(np.std(1.0 / self.pairs, ddof=1)) / np.sqrt(n)
        return float(inertia * 2.0 * HALF_STEP * half)


def paired_runs(segments: Sequence[CoastSegment], directions: Sequence[str | None]) -> list[tuple[int, int]]:
    """Pairs of segment indices: the k-th run out of the description with the k-th run back, where both are kept.

    Where runs are left out, or one direction has more of them, runs that follow each other in the description are
    paired first, so that a missing log does not shift the other pairs.
    """
    at = {s.run: k for k, s in reversed(list(enumerate(segments)))}
    out, back = ([i for i, way in enumerate(directions) if way == wanted] for wanted in ("out", "back"))
    planned = [pair for pair in zip(out, back, strict=False) if at.keys() >= set(pair)]
    if at.keys() >= {*out, *back} and len(out) == len(back):
        return [(at[a], at[b]) for a, b in planned]
    pairs = [(a, b) for a, b in planned if abs(a - b) == 1]
    free = set(at) - {run for pair in pairs for run in pair}
    for run in sorted(free):
        if {run, run + 1} <= free and {directions[run], directions[run + 1]} == {"out", "back"}:
            pairs.append((run, run + 1) if directions[run] == "out" else (run + 1, run))
            free -= {run, run + 1}
    pairs += [pair for pair in planned if free >= set(pair)]
    return [(at[a], at[b]) for a, b in sorted(pairs, key=min)]


def listed_by_start(
    segments: Sequence[CoastSegment], directions: Sequence[str | None], starts: Sequence[float] | None
) -> tuple[list[CoastSegment], list[str | None]]:
    """Segments and directions as if the description listed its runs by their ``starts``; None: it does."""
    order = range(len(directions)) if starts is None else sorted(range(len(directions)), key=lambda k: starts[k])
    place = {run: k for k, run in enumerate(order)}
    return [replace(s, run=place[s.run]) for s in segments], [directions[run] for run in order]


def stated_starts(runs: Sequence[Run]) -> tuple[float, ...] | None:
    """Start times of the runs, s since the first one; None unless every run states one and they differ."""
    found = [r.start.value for r in runs if r.start is not None]
    return tuple(found) if len(found) == len(runs) and np.ptp(found) > 0 else None


def coast_times(segments: Sequence[CoastSegment], directions: Sequence[str | None]) -> list[CoastTimes]:
    """Coast-down times over 10 km/h about each multiple of 10 km/h that all paired runs pass, highest speed first.

    Empty without pairs. The time of a pair is the harmonic mean of its two times.

    Parameters
    ----------
    segments : the fitted coasts. directions : of each segment, "out" or "back"; None: not stated.
    """
    couples = paired_runs(segments, directions)
    if not couples:
        return []
    falls = [falling_speed(s) for s in segments]
    used = [falls[k] for couple in couples for k in couple]
    top, bottom = min(t[1].max() for t in used), max(t[1].min() for t in used)
    first, last = np.floor((top - HALF_STEP) / REFERENCE_STEP), np.ceil((bottom + HALF_STEP) / REFERENCE_STEP)
    found = []
    for step in np.arange(first, last - 0.5, -1.0):
        speed = float(step) * REFERENCE_STEP
        ends = speed + HALF_STEP, speed - HALF_STEP
        times = np.array([[fall_time(falls[k], *ends) for k in couple] for couple in couples])
        found.append(_with_accuracy(speed, 2.0 / np.sum(1.0 / times, axis=1)))
    return found


def _with_accuracy(speed: float, times: Array) -> CoastTimes:
    n = times.size
    spread = float(np.std(times, ddof=1) / np.sqrt(n) / np.mean(times)) if n > 1 else np.nan
    r83, wltp = (t_quantile(n - 1.0) * spread if n >= least else None for least in (R83_PAIRS, WLTP_PAIRS))
    return CoastTimes(speed, times, r83, wltp)


def falling_speed(segment: CoastSegment) -> tuple[Array, Array]:
    """Times (b,) s and nonincreasing speeds (b,) m/s of a coast, averaged over half a second."""
    bins = cut(segment.log.time, SMOOTH)
    return bins.time, np.minimum.accumulate(bins.mean(segment.log["speed"]))


def fall_time(fall: tuple[Array, Array], upper: float, lower: float) -> float:
    """Time, s, in which a coast falls from ``upper`` to ``lower``, m/s; ``fall`` is its ``falling_speed``."""
    time, falling = fall
    begin, end = np.interp([-upper, -lower], -falling, time).tolist()
    return float(end - begin)
