"""Parts of one log that show the road load, and the reason for each part that is left out.

A coast extends from the last time above the upper speed to the first time below the lower one. On an open road the
parts with drive torque are used.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.bins import cut
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.held_speed import held_before, released
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.step_policy import STEP_POLICY

FEWEST_SAMPLES = 20  # of a segment: fewer give neither an estimate of the speed's noise nor ten bins
FEWEST_LEVELS = 3  # of a table of split times: two intervals are the fewest that show a force that changes with speed
SMOOTH = 1.0  # s, over which the speed is averaged to find where it crosses a limit
MARGIN = 1.0  # s left out where torque sets in and ends: a brake may still be applied, the driveline winds up


@dataclass(frozen=True)
class RejectedSegment:
    """A part of a run that is left out: ``start`` and ``stop`` in s of the log's clock, and why.

    ``usual``: as in every test, so that it is listed and not reported. ``length``: s, of what is left out between
    start and stop; None: all of it.
    """

    run: str
    start: float
    stop: float
    why: str
    usual: bool = False
    length: float | None = None

    @property
    def seconds(self) -> float:
        """Duration of what is left out."""
        return self.stop - self.start if self.length is None else self.length


@dataclass(frozen=True)
class CoastSegment:
    """A part of a run that is fitted.

    Parameters
    ----------
    run : index of the run in the description. name : of its log, with the times where there are several parts.
    log : the segment's rows, each with a finite speed.
    part : (n,), label of the window that each row belongs to.
    pushed : (n,) m/s^2, acceleration by the measured drive and the known slope.
    whole : the log of the run. direction : of the run, as stated. kept : spans (s, s) that the description keeps.
    split : whether the log is a table of split times, whose few rows are crossings of speed levels.
    held : s, begin and end of a speed that was held before the coast; None where it was not, or shortly.
    """

    run: int
    name: str
    log: Log
    part: NDArray[np.int64]
    pushed: Array
    whole: Log
    split: bool = False
    held: tuple[float, float] | None = None
    direction: str | None = None
    kept: tuple[tuple[float, float], ...] = ()

    @property
    def fewest(self) -> int:
        """The fewest rows of a segment that can be fitted."""
        return fewest_rows(self.split)

    def rows(self, keep: Mask) -> CoastSegment:
        """The segment reduced to the rows where ``keep`` (n,) is True."""
        return replace(self, log=rows(self.log, keep), part=self.part[keep], pushed=self.pushed[keep])

    def rejected(self, why: str) -> RejectedSegment:
        """The whole segment as rejected."""
        return RejectedSegment(self.name, float(self.log.time[0]), float(self.log.time[-1]), why)


KeptAndRejected = tuple[list[CoastSegment], list[RejectedSegment]]  # what a filter of the segments returns


def kept_and_rejected(each: Iterable[tuple[CoastSegment | None, Sequence[RejectedSegment]]]) -> KeptAndRejected:
    """What is kept and what is rejected of all segments, from what is kept and what is rejected of each."""
    found = list(each)
    return [one for one, _ in found if one is not None], [part for _, parts in found for part in parts]


class NoSegmentError(ResultError):
    """No run has a segment that can be fitted.

    Parameters
    ----------
    rejected : the parts of the runs that are left out.
    """

    def __init__(self, *findings: Finding, rejected: Sequence[RejectedSegment] = ()) -> None:
        super().__init__(*findings)
        self.rejected = tuple(rejected)


def fewest_rows(split: bool) -> int:
    """The fewest rows of a log, or of a table of split times, that can be fitted."""
    return FEWEST_LEVELS if split else FEWEST_SAMPLES


def rows(log: Log, keep: Mask) -> Log:
    """The log reduced to the rows where ``keep`` (n,) is True."""
    return Log(log.name, log.time[keep], {k: v[keep] for k, v in log.channels.items()}, log.findings)


def coast_segment(
    run: int,
    log: Log,
    window: tuple[float, float] | None,
    shortest: float,
    split: bool = False,
    covered_least: float = COASTDOWN_POLICY.least_covered,
) -> CoastSegment | RejectedSegment:
    """The part of a log in which the car coasts through a window of speeds, or the reason why there is none.

    Parameters
    ----------
    run : index of the run. log : with speed, m/s. window : upper and lower speed, m/s; None: the whole fall. shortest :
        s, least duration.
    split : the log is a table of split times. covered_least : share of the window that the fall must cover.
    """
    if log.time.size == 0:
        return RejectedSegment(log.name, 0.0, 0.0, "no row holds a number in every channel that is read")
    rejected = partial(RejectedSegment, log.name, float(log.time[0]), float(log.time[-1]))
    there = np.isfinite(log["speed"])
    if there.sum() < fewest_rows(split):
        return rejected(f"only {there.sum()} samples have a speed")
    whole = rows(log, there)
    smooth = _smoothed(whole)
    upper, lower = window or (float(smooth.max()), float(smooth.min()))
    top, end = _passage(smooth, upper, lower)
    held = None
    if not split:
        high, top = top, released(whole, smooth, top, end)
        held = held_before(whole.time, smooth, high, top)
    if window is None and upper - lower < COASTDOWN_POLICY.least_fall:
        return rejected(f"not a coast-down: the speed falls by less than {COASTDOWN_POLICY.least_fall:g} m/s")
    covered = (min(upper, float(smooth[top])) - max(lower, float(smooth[end]))) / (upper - lower)
    if covered <= 0.0:
        span, wanted = (f"{3.6 * a:.1f} to {3.6 * b:.1f} km/h" for a, b in ((smooth[0], smooth[-1]), (upper, lower)))
        return rejected(f"the speed, {span}, does not fall through any part of the speed window {wanted}")
    if covered < covered_least:
        reach = f"{3.6 * smooth[top]:.1f} to {3.6 * smooth[end]:.1f} km/h"
        wanted = f"{3.6 * upper:.1f} to {3.6 * lower:.1f} km/h"
        return rejected(f"coasts from {reach} only, less than {100 * covered_least:.0f} % of the speed window {wanted}")
    begin, finish = float(whole.time[top]), float(whole.time[end])
    rejected = partial(RejectedSegment, log.name, begin, finish)
    if finish - begin < shortest:
        return rejected(f"lasts {finish - begin:.1f} s, shorter than {shortest:g} s")
    missing = 1 - (end - top + 1) / max(int(np.sum((log.time >= begin) & (log.time <= finish))), 1)
    part = rows(whole, (whole.time >= begin) & (whole.time <= finish))
    if part.time.size < fewest_rows(split):
        why = f"only {part.time.size} samples have a speed from {begin:.1f} s to {finish:.1f} s, where the car coasts"
        return rejected(f"{why} (needed: {fewest_rows(split)})")
    none = np.zeros(part.time.size)
    segment = CoastSegment(run, log.name, part, none.astype(np.int64), none, log, split, held)
    if missing > STEP_POLICY.most_missing:
        beside = _beside_gaps(segment, shortest)
        if beside is None or _falls(beside) < covered_least * (upper - lower):
            return rejected(f"the speed is missing in {100 * missing:.0f} % of the rows")
        return beside
    return segment


def _beside_gaps(segment: CoastSegment, shortest: float) -> CoastSegment | None:
    """The segment as windows before and after gaps of the speed, in which it may be driven; None without such gaps."""
    label = np.r_[0, np.cumsum(np.diff(segment.log.time) > QUALITY.longest_bridge)]
    return long_windows(replace(segment, part=label), shortest) if label[-1] else None


def long_windows(segment: CoastSegment, shortest: float) -> CoastSegment | None:
    """The windows of a segment that last ``shortest`` s and have enough rows to be fitted; None without such ones."""
    time, long = segment.log.time, np.zeros(segment.part.size, dtype=bool)
    for a, b in groups(segment.part):
        long[a : b + 1] = b - a + 1 >= segment.fewest and time[b] - time[a] >= shortest
    return segment.rows(long) if long.any() else None


def _falls(segment: CoastSegment) -> float:
    """Sum of the spans of speed of the windows of a segment, m/s."""
    return sum(float(np.ptp(segment.log["speed"][a : b + 1])) for a, b in groups(segment.part))


def further_coasts(log: Log, used: Sequence[CoastSegment]) -> list[RejectedSegment]:
    """Findings on further coasts of a log, with at least half the speed range and duration of the used parts of one."""
    first, last = float(used[0].log.time[0]), float(used[-1].log.time[-1])
    speed = np.concatenate([s.log["speed"] for s in used])
    window, shortest = (float(speed.max()), float(speed.min())), 0.5 * (last - first)
    parts, found = [log.time < first, log.time > last], []
    while parts:
        part = rows(log, parts.pop(0))
        one = coast_segment(used[0].run, part, window, shortest) if part.time.size >= FEWEST_SAMPLES else None
        if not isinstance(one, CoastSegment):
            continue
        begin, end = float(one.log.time[0]), float(one.log.time[-1])
        inside = (log.time >= part.time[0]) & (log.time <= part.time[-1])
        parts = [inside & (log.time < begin), inside & (log.time > end), *parts]
        why = (
            f"another coast-down: list the log once more, with from_time and to_time around {begin:.0f} to {end:.0f} s"
        )
        found.append(RejectedSegment(log.name, begin, end, why))
    return sorted(found, key=lambda one: one.start)


def _smoothed(log: Log) -> Array:
    """The speed averaged over about a second, so that noise does not cross a limit before the car does, (n,) m/s."""
    bins = cut(log.time, SMOOTH)
    return np.asarray(np.interp(log.time, bins.time, bins.mean(log["speed"])))


def _passage(smooth: Array, upper: float, lower: float) -> tuple[int, int]:
    """First and last index of the fall from ``upper`` to ``lower``, or of the part of it that the log contains.

    The fall ends before a rise by half of this range, which prepares another coast.
    """
    peak = int(np.argmax(smooth))
    after = smooth[peak:]
    rising = np.flatnonzero(after - np.minimum.accumulate(after) > 0.5 * (upper - lower))
    after = after[: int(rising[0])] if rising.size else after
    below = np.flatnonzero(after <= lower)
    end = peak + int(below[0]) if below.size else peak + int(np.argmin(after))
    above = np.flatnonzero(smooth[: end + 1] >= upper)
    return (int(above[-1]) if above.size else peak), end


def driven_segment(
    run: int, log: Log, demand: Array | None, slowest: float, shortest: float
) -> tuple[CoastSegment | None, list[RejectedSegment]]:
    """The parts of a log faster than ``slowest`` and, where ``demand`` is given, driven; and the rejected parts.

    Assumes that the brakes are released while torque or force is above zero, since neither throttle nor brake is
    measured.

    Parameters
    ----------
    demand : (n,), torque or force of the drive, or None. slowest : m/s. shortest : s, least duration of a part.
    """
    good = np.isfinite(log["speed"]) & (log["speed"] > slowest)
    if demand is not None:
        good &= demand > 0
    step = float(np.median(np.diff(log.time)))
    joined = good[1:] & good[:-1] & (np.diff(log.time) < 5 * step)
    label = np.r_[0, np.cumsum(~joined)]
    keep, left = np.zeros(good.size, dtype=bool), []
    for a, b in groups(label):
        if not good[a]:
            continue
        begin, finish = float(log.time[a]), float(log.time[b])
        margin = MARGIN if demand is not None else 0.0
        inside = slice(*np.searchsorted(log.time, [begin + margin, np.nextafter(finish - margin, np.inf)]))
        if finish - begin - 2 * margin >= shortest and inside.stop - inside.start >= FEWEST_SAMPLES:
            keep[inside] = True
        else:
            left.append(RejectedSegment(log.name, begin, finish, f"shorter than {shortest:g} s"))
    if not keep.any():
        return None, left
    return CoastSegment(run, log.name, rows(log, keep), label[keep], np.zeros(int(keep.sum())), log), left


def groups(label: NDArray[np.int64]) -> list[tuple[int, int]]:
    """First and last index of every group of successive equal labels."""
    begins, ends = np.flatnonzero(np.diff(label, prepend=np.nan)), np.flatnonzero(np.diff(label, append=np.nan))
    return list(zip(begins.tolist(), ends.tolist(), strict=True))


def longest_of_runs(segments: Sequence[CoastSegment]) -> tuple[CoastSegment, ...]:
    """The longest segment of each run, in the order of the segments."""
    runs = dict.fromkeys(s.run for s in segments)
    return tuple(max((s for s in segments if s.run == run), key=lambda s: s.log.duration) for run in runs)


def split(segment: CoastSegment) -> list[CoastSegment]:
    """One segment for each of its windows, named by their times."""
    windows = groups(segment.part)
    if len(windows) == 1:
        return [segment]
    index = np.arange(segment.part.size)
    parts = [segment.rows((a <= index) & (index <= b)) for a, b in windows]
    return [replace(p, name=f"{segment.name}, {p.log.time[0]:.0f} to {p.log.time[-1]:.0f} s") for p in parts]
