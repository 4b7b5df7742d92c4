"""Brakes, engaged drivelines and throttles that no channel shows, detected as outliers of the common deceleration.

All segments share one law of deceleration over speed, c(direction) + k V^2, fitted with least absolute deviations,
which tolerates outliers in up to half of the points. Parts that decelerate or accelerate more than that are cut off; a
run of which too little is left is rejected. A deviation that all runs of a direction share is a slope or a wind, and
one that the runs of both directions repeat at a place, where the position is logged, is a hill.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.description.description_model import HEADING
from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.robust_fits import least_absolute_deviations
from vdyn_cli.quantities.arrays import Array, Mask, cumulative_integral, median_deviation
from vdyn_cli.steps.coastdown.coasts.late_clutch import RELEASED
from vdyn_cli.steps.coastdown.coasts.opposite_direction import direction_doubt, fits_opposite
from vdyn_cli.steps.coastdown.coasts.repeated_slope import PlacedExcess, repeated_slope
from vdyn_cli.steps.coastdown.coasts.segments import (
    CoastSegment,
    KeptAndRejected,
    RejectedSegment,
    kept_and_rejected,
    long_windows,
)
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.road.road_position import first_place

INTERVAL = 2.0  # s, over which a deceleration is averaged
DRIVEN_ON = 5  # intervals in which a driver who braked has driven on; a later throttle is found as such


@dataclass(frozen=True)
class _ExcessDeceleration:
    """Excess of a segment's deceleration over the common law, (b,) m/s^2 at ``time`` s and ``speed`` m/s.

    ``usual`` is the mean of that law, ``limit`` (b,) the allowed excess, m/s^2, and ``per_wind`` (b,) the
    deceleration by 1 m/s of headwind, 1/s. ``like`` is the opposite direction, if the run fits it clearly better.
    """

    segment: CoastSegment
    time: Array
    speed: Array
    excess: Array
    usual: float
    limit: Array
    per_wind: Array
    like: str | None

    @property
    def outliers(self) -> NDArray[np.int64]:
        """Indices where two successive intervals exceed the limit, or one exceeds it by far, or it and both beside it.

        A brake or a throttle changes the speed for good. An excess that the neighboring intervals cancel is a wrong
        reading and is not returned, unless the car slows first: then the driver braked and drove on.
        """
        size, level = np.abs(self.excess), COASTDOWN_POLICY.brake_gross * self.limit
        beyond, gross = size > self.limit, size > level
        # Decelerations of mean speeds spread a short pulse over the intervals beside its peak.
        padded = np.pad(self.excess, 1)
        before, after = padded[:-2], padded[2:]
        peak = beyond & (size >= np.maximum(np.abs(before), np.abs(after)))
        gross |= peak & (np.abs(before + self.excess + after) > level)
        # Net excess of each pair with up to two neighbors at either side.
        total, n = np.pad(np.cumsum(np.r_[0.0, self.excess]), 2, mode="edge"), self.excess.size - 1
        net = [np.abs(total[4 + j : 4 + j + n] - total[2 - i : 2 - i + n]) for i in range(3) for j in range(3)]
        kept = np.min(net, axis=0) > np.minimum(self.limit[1:], self.limit[:-1])
        return np.flatnonzero(((beyond[1:] & beyond[:-1]) | gross[1:] | gross[:-1]) & kept | self._driven_on)

    @property
    def _driven_on(self) -> Mask:
        """Whether each pair of successive intervals lies between a gross braking and as gross a throttle after it."""
        scatter = median_deviation(self.excess - np.median(self.excess))
        level = np.maximum(COASTDOWN_POLICY.brake_gross * self.limit, COASTDOWN_POLICY.brake_scatter * scatter)
        found = np.zeros(self.excess.size - 1, dtype=bool)
        for k in np.flatnonzero(self.excess > level):
            later = np.flatnonzero(self.excess[k : k + DRIVEN_ON] < -level[k])
            found[k : k + (int(later[-1]) if later.size else 0)] = True
        return found

    @property
    def pieces(self) -> list[tuple[float, float]]:
        """Begin and end (s) of what is left before, between and after the outliers."""
        at, time = self.outliers, self.segment.log.time
        begins = [float(time[0]), *(self.time[at + 1] + INTERVAL).tolist()]
        ends = [*(self.time[at] - INTERVAL).tolist(), float(time[-1])]
        return list(zip(begins, ends, strict=True))

    @property
    def places(self) -> Array | None:
        """Road coordinates (b,), m; None where the run's position on the road is not logged."""
        log, heading = self.segment.log, HEADING[self.segment.direction]
        first = first_place(log.time, log["speed"], log["position"], heading) if "position" in log else None
        if first is None:
            return None
        return first + heading * np.interp(self.time, log.time, cumulative_integral(log.time, log["speed"]))

    def lost(self, begin: float, end: float) -> float:
        """Speed lost, m/s, by excess decelerations between two times (s)."""
        inside = (self.time > begin) & (self.time < end)
        return INTERVAL * float(np.maximum(self.excess[inside], 0.0).sum())

    def reason(self, at: int) -> str:
        """Sentence on the excess in interval ``at``, with its number, time and speed, and the wind that explains it."""
        at += int(abs(self.excess[at + 1]) > abs(self.excess[at])) if at + 1 < self.excess.size else 0
        what, cause = ("decelerates", "brake or driveline") if self.excess[at] > 0 else ("accelerates", "throttle")
        wind = abs(self.excess[at]) / self.per_wind[at] if self.per_wind[at] > 0.0 else np.inf
        if wind < COASTDOWN_POLICY.plausible_gust:
            cause += f", or {wind:.1f} m/s more {'headwind' if self.excess[at] > 0 else 'tailwind'}"
        # A wrong direction shifts the whole run, and is no cause of an excess that is beyond the limit without it.
        shifted = abs(self.excess[at] - float(np.median(self.excess))) <= self.limit[at]
        return (
            f"{what} by {abs(self.excess[at]):.2f} m/s^2 more than the other runs at {self.time[at]:.0f} s, "
            f"{3.6 * self.speed[at]:.0f} km/h ({cause}?)"
            + (f"; {direction_doubt(self.like)}" if self.like and shifted else "")
        )


def without_braking(segments: Sequence[CoastSegment], window: float | None, shortest: float) -> KeptAndRejected:
    """Coasts without the parts that deviate from the common deceleration (the module's law), and the rejected parts.

    An interrupted coast is kept as several windows of one segment: those before and after a throttle or a tap of the
    brake, but not those before and after a braking that leaves the brakes warm.

    Without a stated window, half of the runs may be driven over the upper speeds and half over the lower ones, and all
    are braked to rest: then a run is compared with what the others cover, not with the range of all together.

    Parameters
    ----------
    window : m/s, span of speed of which at least ``least_covered`` must be left; None: the median of the spans that are
        left.
    shortest : s, duration of a window between two interruptions that is kept.
    """
    compared = _compared(segments)
    if window is None:
        window = float(np.median([_covered(each.segment, _undisturbed(each, shortest)) for each in compared]))
    return kept_and_rejected(_undisturbed_part(each, window, shortest) for each in compared)


def braked_while_coasting(wholes: Sequence[CoastSegment]) -> dict[int, list[tuple[float, str]]]:
    """Times (s) and reasons of every braking within each run's coast, by run, whether or not that part is fitted.

    A driver who brakes and releases leaves warm, dragging brakes, and the other runs do not repeat that coast. An
    excess in the first ``RELEASED`` s of the coast is a late clutch and is left out.

    Parameters
    ----------
    wholes : each run from its highest speed on.
    """
    found: dict[int, list[tuple[float, str]]] = {}
    for each in _compared(wholes):
        late = [int(k) for k in each.outliers if each.excess[k] > 0 and each.time[k] - each.time[0] > RELEASED]
        if late:
            found[each.segment.run] = [(float(each.time[k]), each.reason(k)) for k in late]
    return found


def without_outliers(segments: Sequence[CoastSegment], shortest: float) -> KeptAndRejected:
    """Driven segments without the parts that deviate from drive and common law, and the rejected parts.

    Parameters
    ----------
    shortest : s, duration of a window that is kept.
    """
    return kept_and_rejected(_without_outliers(each, shortest) for each in _compared(segments))


def _without_outliers(one: _ExcessDeceleration, shortest: float) -> tuple[CoastSegment | None, list[RejectedSegment]]:
    """The windows of a driven segment between its outliers, and the span of these."""
    if not (at := one.outliers).size:
        return one.segment, []
    time, windows = one.segment.log.time, _windows(one.segment, one.pieces)
    left = time[~np.isin(time, windows.log.time)]
    span = RejectedSegment(one.segment.name, float(left[0]), float(left[-1]), one.reason(int(at[0])))
    return long_windows(windows, shortest), [span]


def _windows(segment: CoastSegment, pieces: Sequence[tuple[float, float]]) -> CoastSegment:
    """The rows of a segment within some spans of time (s), each of which is a window, as are its parts."""
    time = segment.log.time
    label = np.searchsorted([begin for begin, _ in pieces], time, side="right")
    inside = np.any([(time >= begin) & (time <= end) for begin, end in pieces], axis=0)
    return replace(segment, part=label + (len(pieces) + 1) * segment.part).rows(np.asarray(inside))


def _compared(segments: Sequence[CoastSegment]) -> list[_ExcessDeceleration]:
    """The excess deceleration of each segment over the law that all segments share and the hills of the road."""
    measured = [_deceleration(s) for s in segments]
    found = _over_common_law(segments, measured)
    placed = {k: place for k, one in enumerate(found) if (place := one.places) is not None}
    excess = [PlacedExcess(HEADING[segments[k].direction], at, found[k].excess) for k, at in placed.items()]
    hills = dict(zip(placed, repeated_slope(excess), strict=True))
    if not any(np.any(hill) for hill in hills.values()):
        return found
    level = [(time, speed, value - hills.get(k, 0.0)) for k, (time, speed, value) in enumerate(measured)]
    return _over_common_law(segments, level)


def _over_common_law(
    segments: Sequence[CoastSegment], measured: Sequence[tuple[Array, Array, Array]]
) -> list[_ExcessDeceleration]:
    """The excess of each segment's deceleration over the law c(direction) + k V^2 that all segments share.

    Parameters
    ----------
    measured : of each segment, time, speed and deceleration, (b,) s, m/s, m/s^2.
    """
    speeds, values, directions = [s[1] for s in measured], [s[2] for s in measured], [s.direction for s in segments]
    ways = sorted({str(d) for d in directions})
    column = np.array([ways.index(str(d)) for d in directions])
    each_way = np.eye(len(ways))[np.repeat(column, [v.size for v in speeds])]
    design = np.column_stack([each_way, np.concatenate(speeds) ** 2])
    law = least_absolute_deviations(design, np.concatenate(values))
    constants = [v - law[-1] * u**2 for u, v in zip(speeds, values, strict=True)]
    runs = np.array([np.median(c) for c in constants])
    level = _levels(law[:-1], column, runs)
    common = [level[c] + law[-1] * u**2 for c, u in zip(column, speeds, strict=True)]
    excess = [v - usual for v, usual in zip(values, common, strict=True)]
    per_wind = [2.0 * max(float(law[-1]), 0.0) * u for u in speeds]
    gust = _gust(excess, per_wind)
    found = []
    for k, segment in enumerate(segments):
        separate = directions.count(directions[k]) >= COASTDOWN_POLICY.separating_runs
        least = COASTDOWN_POLICY.brake_excess if separate else COASTDOWN_POLICY.brake_excess_few
        limit, usual = np.maximum(least, gust * per_wind[k]), float(np.mean(common[k]))
        like, time = fits_opposite(runs, directions, k), measured[k][0]
        found.append(_ExcessDeceleration(segment, time, speeds[k], excess[k], usual, limit, per_wind[k], like))
    return found


def _gust(excess: Sequence[Array], per_wind: Sequence[Array]) -> float:
    """The gust, m/s, that a day reaches by chance: ``gust_scatter`` robust standard deviations of the runs' own.

    A gust dv changes the deceleration by rho CdA V dv / M = 2 k V dv. Means of two intervals leave out most of the
    noise of the speed, and the median deviation the brakes.

    Parameters
    ----------
    excess : of each run, (b,) m/s^2. per_wind : of each run, (b,) 2 k V, 1/s.
    """
    pairs = [(e[1:] + e[:-1]) / (w[1:] + w[:-1]) for e, w in zip(excess, per_wind, strict=True) if np.all(w > 0.0)]
    winds = np.concatenate([np.zeros(0), *pairs])
    if not winds.size:
        return 0.0
    return min(COASTDOWN_POLICY.gust_scatter * median_deviation(winds), COASTDOWN_POLICY.largest_gust)


def _levels(fitted: Array, column: NDArray[np.int64], runs: Array) -> Array:
    """The constant term of each direction's deceleration, (d,) m/s^2.

    Of two differing runs, least absolute deviations cannot decide which one is braked: the one closer to the median of
    all directions is used.

    Parameters
    ----------
    fitted : (d,) of each direction. column : (r,) direction of each run. runs : (r,) constant term of each, m/s^2.
    """
    level = fitted.copy()
    for way in range(fitted.size):
        own = runs[column == way]
        if 1 < own.size < COASTDOWN_POLICY.separating_runs and fitted.size > 1:
            level[way] = own[np.argmin(np.abs(own - np.median(runs)))]
    return level


def _deceleration(segment: CoastSegment) -> tuple[Array, Array, Array]:
    """Time, speed and deceleration minus that by known forces, (b,) s, m/s, m/s^2."""
    bins = cut(segment.log.time, INTERVAL, segment.part)
    time, speed, pushed = bins.time, bins.mean(segment.log["speed"]), bins.mean(segment.pushed)
    middles = [0.5 * (x[1:] + x[:-1]) for x in (time, speed, pushed)]
    return middles[0], middles[1], middles[2] - np.diff(speed) / np.diff(time)


def _undisturbed_part(
    one: _ExcessDeceleration, window: float, shortest: float
) -> tuple[CoastSegment | None, list[RejectedSegment]]:
    """The windows of a coast between its interruptions that cover most speed, and the rejected rest."""
    name, time = one.segment.name, one.segment.log.time
    middle = float(np.median(one.excess))
    if middle > max(COASTDOWN_POLICY.engaged_least, COASTDOWN_POLICY.engaged_share * one.usual):
        cause = direction_doubt(one.like) if one.like else "check for an engaged driveline or a dragging brake"
        return None, [
            one.segment.rejected(f"decelerates by {middle:.2f} m/s^2 more than the other runs throughout: {cause}")
        ]
    if not (at := one.outliers).size:
        return one.segment, []
    best = _undisturbed(one, shortest)
    if _covered(one.segment, best) < COASTDOWN_POLICY.least_covered * window:
        return None, [one.segment.rejected(one.reason(int(at[0])))]
    edges = [float(time[0]), *(t for pair in best for t in pair), float(time[-1])]
    lost = [(a, b, at[(one.time[at] > a) & (one.time[at] < b)]) for a, b in zip(edges[::2], edges[1::2], strict=True)]
    parts = [RejectedSegment(name, a, b, one.reason(int(k[0]))) for a, b, k in lost if k.size]
    return _windows(one.segment, best), parts


def _undisturbed(one: _ExcessDeceleration, shortest: float) -> list[tuple[float, float]]:
    """Begin and end (s) of the windows that cover most speed together, without a warm brake before one of them.

    Windows shorter than ``shortest`` (s) are left out beside longer ones.
    """
    pieces = [p for p in one.pieces if _covered(one.segment, [p]) > 0.0] or one.pieces[:1]
    pieces = [p for p in pieces if p[1] - p[0] >= shortest] or pieces
    joined = [pieces[:1]]
    for piece in pieces[1:]:
        if one.lost(joined[-1][-1][1], piece[0]) < COASTDOWN_POLICY.brake_warm:
            joined[-1].append(piece)
        else:
            joined.append([piece])
    return max(joined, key=lambda windows: _covered(one.segment, windows))


def _covered(segment: CoastSegment, pieces: Sequence[tuple[float, float]]) -> float:
    """Sum of the spans of speed of these times, m/s."""
    time, spans = segment.log.time, 0.0
    for begin, end in pieces:
        inside = (time >= begin) & (time <= end)
        spans += float(np.ptp(segment.log["speed"][inside])) if inside.sum() >= segment.fewest else 0.0
    return spans
