"""Segments in which a channel is more regular than its noise allows: frozen at a value, or on a straight line."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Mask, Rows

Spans = list[tuple[int, int]]

LINE = 5  # intervals of the shortest line that is tested
UNSEEN = 0.2  # assumed probability that a rest continues, for a channel without other rests
_SAMPLE = 20_000  # values that suffice to estimate a channel's resolution


def quantum(values: Array) -> float:
    """The smallest difference between any two of the values (n,), but no less than single precision resolves, 2e-7."""
    some = np.unique(values[:: -(-values.size // _SAMPLE)])
    steps, least = np.diff(some), 2e-7 * float(np.abs(some).max(initial=0.0))
    return float(max(steps[steps > least].min(initial=np.inf), least)) if np.any(steps > least) else least


def equal(values: Array) -> Mask:
    """Whether each value (n,) equals the previous one, (n,)."""
    return np.concatenate([[False], values[1:] == values[:-1]])


def straight(place: Array, values: Array, tolerance: float) -> Mask:
    """Whether each value (n,) and the five before it lie within ``tolerance`` of the chord of the six, (n,).

    Parameters
    ----------
    place : (n,), increasing: times, or row numbers. values : (n,).
    """
    if values.size <= LINE:
        return np.zeros(values.size, dtype=bool)
    first, last, begin = values[:-LINE], values[LINE:], place[:-LINE]
    slope = (last - first) / (place[LINE:] - begin)
    good = np.ones(first.size, dtype=bool)
    for j in range(1, LINE):
        good &= np.abs(values[j : j - LINE] - first - slope * (place[j : j - LINE] - begin)) <= tolerance
    return np.concatenate([np.zeros(LINE, dtype=bool), good])


def rounded_line(places: Sequence[Array], values: Array, resolution: float) -> bool:
    """Whether a segment can be a rounded line: equal steps, rounded, differ by at most one quantum.

    Coarse values with little noise scatter by two quanta, as a slow torque in steps of 0.5 N m does.

    Parameters
    ----------
    places : (n,) times, and row numbers, either of which may be evenly stepped. values : (n,). resolution : quantum.
    """
    shares = []
    for place in places:
        level = values - np.polyval(np.polyfit(place - place[0], values, 1), place - place[0])
        shares.append(np.mean(np.abs(np.diff(level, 2)) > 1.5 * resolution))
    return bool(min(shares) <= QUALITY.line_bends)


def nearly_straight(values: Array, tolerance: float) -> Mask:
    """Whether each value (n,) is within four tolerances of the line through the two values before it, (n,)."""
    bends = np.abs(values[2:] - 2.0 * values[1:-1] + values[:-2])
    return np.concatenate([[False, False], bends <= 4.0 * tolerance])


def alternating(values: Array, tolerance: float) -> Mask:
    """Whether the bend x_k - 2 x_k-1 + x_k-2 of values (n,) exceeds four tolerances and changes sign, (n,)."""
    bends = values[2:] - 2.0 * values[1:-1] + values[:-2]
    bends = np.where(np.abs(bends) > 4.0 * tolerance, bends, 0.0)
    return np.concatenate([[False, False, False], bends[1:] * bends[:-1] < 0.0])[: values.size]


@dataclass(frozen=True, eq=False)
class Continuation:
    """Estimate of the probability that a regular sample follows a regular one, outside of any segment.

    Parameters
    ----------
    judged, ones, pairs : (n + 1,), cumulative numbers of judged samples, of regular ones among them, and of regular
        ones that follow a regular one.
    """

    judged: Rows
    ones: Rows
    pairs: Rows

    @classmethod
    def of(cls, regular: Mask, judged: Mask) -> Continuation:
        """Count the ``regular`` (n,) samples where ``judged`` (n,)."""
        here = regular & judged
        follows = here & np.concatenate([[False], regular[:-1]])
        return cls(*(np.concatenate([[0], np.cumsum(x)]) for x in (judged, here, follows)))

    def outside(self, first: int, stop: int) -> float:
        """The probability estimated outside of the segment [first, stop), in (0, 1)."""
        ones = self.ones[-1] - self.ones[stop] + self.ones[first]
        pairs = self.pairs[-1] - self.pairs[stop] + self.pairs[first]
        return float((pairs + 1.0) / (ones + 2.0))

    def beside(self, taken: Spans) -> tuple[int, int]:
        """Numbers of judged samples, and of regular ones among them, outside of some segments."""
        judged = int(self.judged[-1]) - sum(int(self.judged[b] - self.judged[a]) for a, b in taken)
        return judged, int(self.ones[-1]) - sum(int(self.ones[b] - self.ones[a]) for a, b in taken)


def improbable_segments(
    regular: Mask,
    judged: Mask,
    longer: float,
    before: int = 1,
    finer: Sequence[Continuation] = (),
) -> Spans:
    """The segments of regular samples that chance does not explain.

    A regular sample is followed by another one with a probability c, estimated around the segment and over the whole
    log. The probability that one of n segments has L samples by chance is at most n c^(L - 1).

    Parameters
    ----------
    regular : (n,). judged : (n,), where the channel must show noise; a segment counts if most of it is judged.
    longer : least length of an improbable segment, times the longest ordinary segment.
    before : samples before each segment that belong to it: 1 for equal values, ``LINE`` for straight lines.
    finer : continuations of independent, weaker conditions of regularity, the product of whose probabilities is the
        prior of c, with the weight of one sample; empty: `UNSEEN`.
    """
    edges = np.flatnonzero(np.diff(regular, prepend=False, append=False))
    begin, stop = edges[::2], edges[1::2]
    if begin.size == 0:
        return []
    length = stop - begin
    total = np.concatenate([[0], np.cumsum(judged)])
    eligible = total[stop] - total[begin] > 0.5 * length
    begin, stop, length = begin[eligible], stop[eligible], length[eligible]
    shortest = QUALITY.shortest_segment
    long = np.flatnonzero(length + before >= shortest)
    if long.size == 0:
        return []
    counted = Continuation.of(regular, judged)
    ones, pairs = counted.ones, counted.pairs
    bound = np.log(QUALITY.false_alarm / max(int(length.size), 1))
    order = long[np.argsort(-length[long], kind="stable")]
    found: list[int] = []
    removed_ones = removed_pairs = 0
    for i in order:  # the longest first, so that it does not count as ordinary for the others
        a, b, n = int(begin[i]), int(stop[i]), int(length[i])
        reach = int(max(QUALITY.surroundings * n, QUALITY.fewest_surroundings))
        near = (max(a - reach, 0), min(b + reach, regular.size))
        own_ones, own_pairs = ones[b] - ones[a], pairs[b] - pairs[a]
        inside = [k for k in found if begin[k] >= near[0] and stop[k] <= near[1]]
        near_ones = ones[near[1]] - ones[near[0]] - own_ones - sum(int(length[k]) for k in inside)
        near_pairs = pairs[near[1]] - pairs[near[0]] - own_pairs - sum(int(length[k]) - 1 for k in inside)
        all_ones, all_pairs = ones[-1] - own_ones - removed_ones, pairs[-1] - own_pairs - removed_pairs
        expected = float(np.prod([one.outside(a, b) for one in finer])) if finer else UNSEEN
        chance = max(
            (near_pairs + expected) / (max(near_ones, near_pairs) + 1.0), (all_pairs + expected) / (all_ones + 1.0)
        )
        if (n - 1) * np.log(min(chance, 1.0)) > bound:
            break
        found.append(int(i))
        removed_ones, removed_pairs = removed_ones + own_ones, removed_pairs + own_pairs
    taken = [(int(begin[i]), int(stop[i])) for i in found]
    beside = [one.beside(taken) for one in (finer or (counted,))]
    coarse = min(ones / max(judged, 1) for judged, ones in beside) > QUALITY.coarse_share
    if coarse and not finer:
        return []  # such a channel may be constant for any time at constant speed
    return _above(begin, stop, length, found, max(longer, QUALITY.coarse_line_ratio) if coarse else longer, before)


def _above(
    begin: Rows,
    stop: Rows,
    length: Rows,
    found: list[int],
    longer: float,
    before: int,
) -> Spans:
    """The found segments that are ``longer`` times the longest ordinary one, and all longer ones."""
    if not found:
        return []
    others = np.delete(length, found)
    ordinary = int(others.max(initial=0))
    kept: list[int] = []
    for i in reversed(found):  # the shortest first: it is ordinary unless it is much longer than the next
        if not kept and length[i] + before < longer * (ordinary + before):
            ordinary = max(ordinary, int(length[i]))
            continue
        kept.append(i)
    return sorted((int(begin[i]) - before, int(stop[i])) for i in kept)


def merged(found: Spans, share: float) -> Spans:
    """The spans, merged where the gap between two is at most ``share`` of the shorter one."""
    out: Spans = []
    for a, b in sorted(found):
        if out and a - out[-1][1] <= share * min(b - a, out[-1][1] - out[-1][0]):
            out[-1] = (out[-1][0], max(b, out[-1][1]))
        else:
            out.append((a, b))
    return out
