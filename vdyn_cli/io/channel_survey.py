"""Facts about each channel of a log of any format: rate, span, range, constant segments, identical channels."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Literal

import numpy as np

from vdyn_cli.io.clocks.written_times import FORMS
from vdyn_cli.io.formats.log_formats import readers
from vdyn_cli.io.formats.split_times import MOST_LEVELS
from vdyn_cli.io.missing_marks import missing_mark
from vdyn_cli.io.one_recording import one_recording
from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.stalls import Stalls
from vdyn_cli.io.reader import MOST_LATE, Browsable, ChannelInfo, Column, ReadOptions, Recorded, Selective, is_clock
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import UnitError, from_si

# Names of texts that may be times, also those of the columns of a file without a header.
_OF_TIME = re.compile(
    r"time|date|zeit|datum|uhr|stamp|temps|heure|hora|tiempo|tempo|utc|clock|时|時|시간|время|^column \d+$",
    re.IGNORECASE,
)
State = Literal["clock", "varies", "constant", "empty", "text"]

_SWITCH = 16  # distinct values; a channel with no more is a switch or a gear, which may be constant for any time
_REST = 0.1  # of the channel's duration: shorter constant segments are usual in traffic
_SHORTEST_REST = 10.0  # s
_MOST_INCREASING = 3  # columns: a table of cumulative counts has more, and none of them is known to be the time
_STEADY = 0.1  # of the median step of a clock, by which most steps may differ: a distance's differ by more
_MOSTLY = 0.8  # of the steps
_ANGLES = 20_000  # samples that suffice for a mean angle
_LONG_FALL = 10.0  # s; shorter decreases of speed are braking
_LONGEST_PLATEAU = 60.0  # s without a lower mean: a ride uphill at a steady speed, and no hill of a test road
_LOWER = 0.04  # of half the range, by which a mean is lower: a coasting car loses as much in some 10 s
_FALL_STEP = 2.0  # s, averaging time: a coasting car loses more speed in it than the noise of a receiver's mean


@dataclass(frozen=True)
class ChannelFacts:
    """Facts about a channel.

    Parameters
    ----------
    info : name, unit, rate, span, group and source.
    column : its name in a description; ``#1``, ``#2`` are appended to equal names that no group distinguishes.
    state : ``clock``, ``varies``, ``constant``, ``empty``, or ``text``.
    samples : number of recorded values.
    lowest, highest : in the unit of the file; NaN for an empty channel.
    rest : first and last time (s) and value of the longest constant segment of a channel that varies otherwise; None
        if none lasts 10 s, and a tenth of the channel's duration or until a jump.
    same_as : the first channel with the same samples; empty if there is none.
    repeated : number of channels of the file with this name.
    ends : first and last recorded value, in the unit of the file; NaN for an empty channel.
    angle : mean of exp(i x) with x in degrees: its argument is the mean angle, its modulus 1 if all x are equal.
    longest_fall : longest time, s, over which successive 2 s means of the absolute value decrease.
    mark : (number of samples, value) of the mark of missing values, which do not count; None if there is none.
    gaps : number of gaps of a clock, and the times, s, before and after the longest; None if there is none.
    stalls : first and last time, s, of each segment in which all channels of a clock repeat their values.
    decreases : number of decreases of a channel without times, and the values of the first; None if there is none.
    counts : whether a channel without times increases in steps of mostly one size, like a clock or a row's number.
    falls : first and last time, s, of each decrease of the absolute value by half of its range; empty if none lasts
        10 s.
    sharing : rows of a clock that share the time of the one before, if it has too few digits, such as full seconds;
        0 for other channels.
    """

    info: ChannelInfo
    column: str
    state: State
    samples: int
    lowest: float
    highest: float
    rest: tuple[float, float, float] | None = None
    same_as: str = ""
    repeated: int = 1
    ends: tuple[float, float] = (math.nan, math.nan)
    angle: complex = 0.0
    longest_fall: float = 0.0
    falls: tuple[tuple[float, float], ...] = ()
    decreases: tuple[int, float, float] | None = None
    counts: bool = False
    mark: tuple[int, float] | None = None
    gaps: tuple[int, float, float] | None = None
    stalls: tuple[tuple[float, float], ...] = ()
    sharing: int = 0


def survey(
    path: Path, span: tuple[float, float] | None = None, recording: int = 1, only: Callable[[str], bool] = bool
) -> tuple[ChannelFacts, ...]:
    """The facts about each channel of a log, in the file's order.

    Parameters
    ----------
    span : first and last time, s, of the part to evaluate; None: the whole log.
    recording : number of the recording to evaluate, counted from 1, in a file whose clock restarts.
    only : name of a channel -> whether it matters; of the others, a reader that can does not read the samples.

    Raises
    ------
    InputError : the file cannot be read.
    """
    facts: list[ChannelFacts] = []
    seen: dict[str, str] = {}
    names: dict[tuple[str, str], int] = {}
    stalls: dict[tuple[int, float, float], Stalls] = {}
    clocks_at: dict[int, tuple[int, float, float]] = {}
    for whole in one_recording(recorded_channels(path, only), recording):
        recorded = whole if span is None else _within(whole, span)
        info = recorded.info
        names[info.group, info.name] = names.get((info.group, info.name), 0) + 1
        nth = names[info.group, info.name]
        column = info.name if nth == 1 else f"{info.name}#{nth}"
        one = _facts(recorded, column)
        mark = _fingerprint(recorded) if one.state == "varies" else ""
        label = f"{info.group}.{column}" if info.group else column
        same = seen.setdefault(mark, label) if mark else label
        facts.append(replace(one, same_as="" if same == label else same))
        if (
            one.state == "varies"
            and recorded.time is not None
            and recorded.values is not None
            and not facts[-1].same_as
        ):
            stalls.setdefault(_clock_of(recorded.time), Stalls(recorded.time)).add(recorded.values)
        if one.state == "clock" and recorded.time is not None:
            clocks_at[len(facts) - 1] = _clock_of(recorded.time)
    for i, clock in clocks_at.items():
        facts[i] = replace(facts[i], sharing=_sharing(facts[i], facts))
        if clock in stalls:
            facts[i] = replace(facts[i], stalls=stalls[clock].found())
    # A name that several channels share does not select the first of them, except for the clocks of a file's tables.
    clocks = [f.info.name for f in facts if f.state == "clock"]
    several = {
        f.column: f"{f.column}#1"
        for f in facts
        if names[f.info.group, f.info.name] > 1 and f.column == f.info.name and clocks.count(f.info.name) < 2
    }
    return tuple(
        replace(
            f,
            column=several.get(f.column, f.column),
            same_as=several.get(f.same_as, f.same_as),
            repeated=sum(o.info.name == f.info.name for o in facts),
        )
        for f in facts
    )


def _clock_of(time: Array) -> tuple[int, float, float]:
    """What the channels of one clock share: the number of their times, and the first and last one."""
    return (time.size, float(time[0]), float(time[-1])) if time.size else (0, 0.0, 0.0)


def _sharing(clock: ChannelFacts, facts: Sequence[ChannelFacts]) -> int:
    """The rows that share the time of the one before, if a channel differs in too many of them."""
    if not math.isfinite(clock.info.rate):  # a single sample
        return 0
    beside = [
        f for f in facts if f.state == "varies" and f.info.group == clock.info.group and f.info.rate == f.info.rate
    ]
    most = max((_different(f) for f in beside), default=0)
    too_many = most - _different(clock) > MOST_LATE * clock.samples
    return clock.samples - _different(clock) if too_many else 0


def _different(one: ChannelFacts) -> int:
    """The number of samples that do not repeat the time and the value of the one before."""
    return round(one.info.rate * (one.info.span[1] - one.info.span[0])) + 1


def _gaps(time: Array) -> tuple[int, float, float] | None:
    """The number of gaps of a clock, and the times before and after the longest one."""
    known = time[np.isfinite(time)]
    at = clock_gaps(known)
    if not at.size:
        return None
    worst = at[np.argmax(known[at + 1] - known[at])]
    return int(at.size), float(known[worst]), float(known[worst + 1])


def without_clock(facts: Sequence[ChannelFacts]) -> tuple[str, str]:
    """Why none of a file's columns is a clock, and the remedy."""
    named = next((f for f in facts if f.state in ("varies", "constant") and is_clock(f.info.name)), None)
    if named is None:
        texts = ", ".join(f"'{f.column}'" for f in facts if f.state == "text" and _OF_TIME.search(f.column))
        remedy = f"if the text of {texts} is the time, export it as {FORMS}" if texts else "export it with its time"
        if other := remedy_of_increasing(facts):
            remedy = f"{other}; {remedy}"
        remedy += "; if its rate is fixed, describe it without 'time', but with its rate, as in 'reading: {rate: 1 Hz}'"
        if facts and max(f.samples for f in facts) <= MOST_LEVELS:
            remedy += (
                "; if it is a table of split times, write one row for each speed level and add 'reading: {split_times: "
                "elapsed}', or 'intervals' for times counted from the level of the row above"
            )
        return "no column increases like a clock", remedy
    what = f"column '{named.column}' has the name of a clock, but its values do not increase"
    if named.decreases is not None:
        count, before, behind = named.decreases
        what += f": {before:.10g} is followed by {behind:.10g}" + (f", and {count - 1} more" if count > 1 else "")
    if facts[-1].state == "empty":
        return what, f"the last column, '{facts[-1].column}', is empty: if the header has a name too many, remove it"
    if other := remedy_of_increasing(facts):
        return what, f"{other}; or correct the header if it exchanges two names"
    remedy = "sort the rows by time, split the file where its time steps back, or export a time that has all its digits"
    return what, remedy


def remedy_of_increasing(facts: Sequence[ChannelFacts]) -> str:
    """The remedy that maps one of the columns that increase, at most three, as the time; empty if there are none."""
    found = [f"'{f.column}'" for f in facts if f.counts and f.state == "varies"]
    if not 0 < len(found) <= _MOST_INCREASING:
        return ""
    which = "which increases" if len(found) == 1 else "which increase"
    named = f"if {' or '.join(found)}, {which}, is the time"
    return f"{named}, name it 'Time [s]' or map it as 'time' with its unit, such as 0.1 ms"


def recordings(path: Path) -> Iterator[Recorded]:
    """Every channel with its samples; of a file whose clock restarts, those of the first recording.

    Raises
    ------
    InputError : the file cannot be read.
    """
    yield from one_recording(recorded_channels(path), 1)


def recorded_channels(path: Path, only: Callable[[str], bool] = bool) -> Iterator[Recorded]:
    """Every channel with its samples; a reader without ``recordings`` reads them by name.

    ``only``: name of a channel -> whether its samples matter.

    Raises
    ------
    InputError : the file cannot be read.
    """
    known, _ = readers()
    reader = next((r for r in known if r.matches(path)), known[-1])
    if isinstance(reader, Selective):
        yield from reader.selected(path, only)
        return
    if isinstance(reader, Browsable):
        yield from reader.recordings(path)
        return
    infos = reader.channels(path)
    clock = next((c for c in infos if is_clock(c.name)), None)
    if clock is None:
        yield from (Recorded(info, None, None) for info in infos)
        return
    mapping = {"time": Column(clock.name, clock.unit or "s", clock.unit or "s")}
    mapping |= {c.name: Column(c.name, c.unit, c.unit, optional=True) for c in infos if c is not clock}
    log: Log = reader.read(path, mapping, ReadOptions(), path.name)
    for info in infos:
        values = log.time if info is clock else log.channels.get(info.name)
        yield Recorded(info, log.time, values)


def _within(recorded: Recorded, span: tuple[float, float]) -> Recorded:
    """The samples within a time span; all samples of a channel without a clock."""
    time, values = recorded.time, recorded.values
    if time is None or not (inside := (time >= span[0]) & (time <= span[1])).any():
        return recorded
    own = time[inside]
    info = replace(recorded.info, span=(float(own[0]), float(own[-1])))
    return Recorded(info, own, own if values is time else None if values is None else values[inside])


def _facts(recorded: Recorded, column: str) -> ChannelFacts:
    info, time, values = recorded.info, recorded.time, recorded.values
    nan = float("nan")
    if values is None:
        return ChannelFacts(info, column, "text", 0, nan, nan)
    written = np.isfinite(values)
    mark = missing_mark(values) if time is not values else None
    marked = (int(np.count_nonzero(values == mark)), mark) if mark is not None else None
    written &= values != mark
    if time is not None:
        written &= np.isfinite(time)
    some = values[written] if not written.all() else values
    if some.size == 0:
        return ChannelFacts(info, column, "empty", 0, nan, nan)
    lowest, highest = float(some.min()), float(some.max())
    state: State = "constant" if lowest == highest else "varies"
    if time is values:
        state = "clock"
        with suppress(UnitError):  # its times are in s, its limits in the unit of the file
            lowest, highest = (from_si(x, info.unit or "s", "s") for x in (lowest, highest))
    gaps = _gaps(time) if state == "clock" and time is not None else None
    rest = _rest(time[written], some) if state == "varies" and time is not None else None
    size = np.abs(some)  # of a speed that is negative on the way back
    fall = _longest_fall(time[written], size) if state == "varies" and time is not None else 0.0
    down = np.flatnonzero(np.diff(some) < 0.0) if time is None else np.empty(0, dtype=np.intp)
    decreases = (down.size, float(some[down[0]]), float(some[down[0] + 1])) if down.size else None
    counts = time is None and not down.size and _counts(some)
    angle = complex(np.mean(np.exp(1j * np.radians(some[:: -(-some.size // _ANGLES)]))))
    ends = float(some[0]), float(some[-1])
    facts = ChannelFacts(info, column, state, int(some.size), lowest, highest, rest)
    falls = _falls(time[written], size) if time is not None and fall >= _LONG_FALL else ()
    return replace(
        facts,
        ends=ends,
        angle=angle,
        longest_fall=fall,
        falls=falls,
        decreases=decreases,
        counts=counts,
        mark=marked,
        gaps=gaps,
    )


def _counts(values: Array) -> bool:
    """Whether values (n,) that never decrease have steps of one size, more of them than a label of a few groups."""
    steps = np.diff(values)
    steps = steps[steps > 0.0]
    if steps.size < min(_SWITCH, values.size // 2):
        return False
    median = float(np.median(steps))
    return bool(np.mean(np.abs(steps - median) <= _STEADY * median) >= _MOSTLY)


def _longest_fall(time: Array, values: Array) -> float:
    """The longest time, s, over which each 2 s mean (or sample, if these are rarer) is below the previous one.

    Gaps within that time do not count.
    """
    begins, means = _step_means(time, values)
    if means.size < 2:
        return 0.0
    turns = np.flatnonzero(np.concatenate([[True], np.diff(means) >= 0.0, [True]]))
    return float((np.diff(turns).max() - 1) * np.median(np.diff(begins)))


def _falls(time: Array, values: Array) -> tuple[tuple[float, float], ...]:
    """First and last time of each decrease by half of the range, without a long plateau or an increase by a quarter."""
    begins, means = _step_means(time, values)
    half = 0.5 * float(np.ptp(means))
    found: list[tuple[int, int]] = []
    high = lower = low = 0
    for i, mean in enumerate(means.tolist()):
        ended = mean - means[low] >= 0.5 * half or begins[i] - begins[lower] > _LONGEST_PLATEAU
        if ended:
            found.append((high, low))
        if ended or mean >= means[high]:
            high = lower = low = i
        elif mean <= means[low]:
            low = i
            lower = i if mean <= means[lower] - _LOWER * half else lower
    found.append((high, low))
    return tuple((float(begins[a]), float(begins[b])) for a, b in found if half > 0.0 and means[a] - means[b] >= half)


def _step_means(time: Array, values: Array) -> tuple[Array, Array]:
    """Start, s, and mean of each 2 s interval that has samples."""
    bins = np.floor((time - time[0]) / _FALL_STEP)
    first = np.flatnonzero(np.diff(bins, prepend=-1.0) > 0.0)
    return time[first], np.add.reduceat(values, first) / np.diff(first, append=values.size)


def _rest(time: Array, values: Array) -> tuple[float, float, float] | None:
    """Start, end and value of the longest constant segment of a channel with many distinct values.

    It lasts 10 s, and a tenth of the time unless the channel jumps at its end from a value other than zero.
    """
    starts = np.concatenate([[0], np.flatnonzero(values[1:] != values[:-1]) + 1])
    if starts.size <= _SWITCH or np.unique(values[starts]).size <= _SWITCH:
        return None
    stops = np.append(starts[1:] - 1, values.size - 1)
    length = time[stops] - time[starts]
    steps = np.append(np.abs(values[starts[1:]] - values[stops[:-1]]), 0.0)
    frozen = (values[starts] != 0.0) & (steps > QUALITY.exit_jump * np.quantile(steps[:-1], 0.99))
    length[(length < _REST * (time[-1] - time[0])) & ~frozen] = 0.0
    longest = int(np.argmax(length))
    if length[longest] < _SHORTEST_REST:
        return None
    return float(time[starts[longest]]), float(time[stops[longest]]), float(values[starts[longest]])


def _fingerprint(recorded: Recorded) -> str:
    """Hash that is equal for channels with the same samples, number of samples and time span."""
    values = recorded.values
    if values is None:
        return ""
    return f"{hashlib.sha256(values.tobytes()).hexdigest()} {recorded.info.span}"
