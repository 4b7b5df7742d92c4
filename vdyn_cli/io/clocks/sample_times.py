"""Checks of a log's clock: rows where time does not increase, gaps, jitter, wrong unit; each correction is reported."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.appended_recordings import restarts
from vdyn_cli.io.reader import MOST_LATE, rises
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

LineOf = Callable[[int], int]

_FEWEST_TIMES = 5  # different ones, from which a fixed rate is estimated
_UNEVEN = 0.25  # of the usual number of rows for each time: a logger's 10 Hz gives 9 to 11 rows a second
SHORTEST_LOG, LONGEST_LOG = 0.05, 3e6  # s: a shaft oscillates for a tenth of a second; a month
FINEST, COARSEST = 2e-6, 60.0  # s, mean step: torque sensors reach 250 kHz; one sample a minute shows no motion
MOST_ACCELERATION = 60.0  # m/s^2, the bound of the channel 'acceleration': six times that of a tire on a dry road
_MOST_LINES = 4  # line numbers listed in a message
_ENOUGH = 200_000  # steps that suffice for the median step and its scatter


@dataclass(frozen=True)
class Rising:
    """Which rows have increasing time (None: all), with notes (``findings``) and errors (``problems``)."""

    kept: Mask | None
    findings: tuple[Finding, ...] = ()
    problems: tuple[Finding, ...] = ()


def check_rising(
    time: Array,
    mode: Literal["strict", "drop"],
    where: str,
    line_of: LineOf,
    row: str = "line",
    channels: Mapping[str, Array] | None = None,
) -> Rising:
    """Find rows whose time does not exceed that of all rows before.

    Rows that repeat the previous one in time and channels are removed in both modes.

    Parameters
    ----------
    time : (n,) s.
    mode : ``strict`` makes such rows a problem, ``drop`` removes and reports them.
    where : the file and its column.
    line_of : row -> line of the file.
    row : the word for a row's place in messages.
    channels : (n,) each, compared to find repeated rows; None: do not look for them.
    """
    again = _repeated(time, channels or {})
    if again.any():
        kept, rows = ~again, np.flatnonzero(~again)
        rest = check_rising(time[kept], mode, where, lambda i: line_of(int(rows[i])), row)
        if rest.kept is not None:
            kept[rows] = rest.kept
        places = lines_of(np.flatnonzero(again), line_of)
        what = f"{_count(int(again.sum()), 'row')} left out: equal to the row before ({row} {places})"
        # Equal rows of a clock with too few digits are samples of a car at rest, without which its rate is not fixed.
        if not (rest.problems and _fixed_rate(time)):
            return Rising(kept, (Finding(where, what, minor=True), *rest.findings), rest.problems)
    missing = np.isnan(time)
    if not missing.any() and (time[1:] > time[:-1]).all():
        return Rising(None)
    filled = np.where(missing, -np.inf, time)
    high = np.maximum.accumulate(filled)
    kept = ~missing
    kept[1:] &= filled[1:] > high[:-1]
    begins = restarts(time)
    if begins:
        return Rising(kept, problems=(_several_recordings(time, begins, where, line_of, row),))
    dropped = np.flatnonzero(~kept)
    what = _description(time, high, dropped, line_of, row)
    if mode == "drop" and dropped.size <= MOST_LATE * time.size:
        return Rising(kept, findings=(Finding(where, f"{what}; {_count(dropped.size, 'row')} left out"),))
    remedy = _remedy(time, dropped.size / time.size, mode, channels or {})
    return Rising(kept, problems=(Finding(where, what, remedy=remedy),))


def _several_recordings(time: Array, begins: Sequence[int], where: str, line_of: LineOf, row: str) -> Finding:
    """The problem of a file that holds several recordings, whose clock restarts at the rows ``begins``."""
    what = f"time restarts at {time[begins[0]]:.10g} s at {row} {lines_of(begins, line_of)}"
    remedy = (
        f"the file has {len(begins) + 1} recordings: list it as one run for each, with 'recording: 1' to "
        f"'recording: {len(begins) + 1}', or split it there, or map a clock that does not restart"
    )
    return Finding(where, what, remedy=remedy)


def _remedy(time: Array, share: float, mode: str, channels: Mapping[str, Array]) -> str:
    """What to do about a share of rows (0 to 1) whose time does not increase."""
    if mode == "drop":
        return f"more than {100 * MOST_LATE:.0f} % of the rows would be left out: export the log again, or split it"
    if share <= MOST_LATE and (time[1:] > time[:-1]).any():
        return "export the log again, or write 'reading: {clock: drop}' to leave these rows out"
    if not (time[1:] < time[:-1]).any():
        return _of_too_few_digits(time)
    if clocks := [n for n, v in channels.items() if rises(v)]:
        return (
            f"'{clocks[0]}' increases like a clock: exchange the columns of 'time' and '{clocks[0]}' in the "
            "description, or correct the header if it names them wrongly"
        )
    return "sort the rows by their time, or export the log again"


def _repeated(time: Array, channels: Mapping[str, Array]) -> Mask:
    """Which rows (n,) repeat the time and the channels of the previous one; none if there are no channels."""
    again = np.zeros(time.size, dtype=bool)
    again[1:] = (time[1:] == time[:-1]) & bool(channels)
    for values in channels.values() if again.any() else ():
        again[1:] &= (values[1:] == values[:-1]) | (np.isnan(values[1:]) & np.isnan(values[:-1]))
    return again


def _description(time: Array, high: Array, dropped: NDArray[np.int64], line_of: LineOf, row: str) -> str:
    """Text of the errors in the rows where time does not increase, with their lines."""
    before = high[np.maximum(dropped - 1, 0)]
    kinds = (
        ("is missing", np.isnan(time[dropped])),
        ("repeats", time[dropped] == before),
        ("steps back", time[dropped] < before),
    )
    parts = []
    for words, which in kinds:
        those = dropped[which]
        if those.size:
            parts.append(f"{words} in {_count(those.size, 'row')} ({row} {lines_of(those, line_of)})")
    back = np.flatnonzero(np.diff(time) < 0.0)
    text = "time " + ", ".join(parts)
    if back.size:
        at = int(back[np.argmin(np.diff(time)[back])])
        step = f"from {time[at]:.10g} s to {time[at + 1]:.10g} s"
        text += f"; the largest step back is {step} at {row} {line_of(at + 1)}"
    return text


def check_steps(log: Log, beside: bool = False) -> tuple[Finding, ...]:
    """Findings on a log's clock: gaps, uneven steps, and steps so large or small that the unit is doubtful.

    With the 5 %, 50 % and 95 % quantiles a, m, b of the steps: a gap exceeds max(1.6 m, m + 4 (b - a)), the steps are
    uneven for b - a > 0.1 m, and the unit is doubtful for m > 10 s or m < 10 us.

    Parameters
    ----------
    beside : whether the file has another clock, whose steps show the unit: long ones are those of a slow channel.
    """
    time, where, line_of = log.time, log.place("time"), log.line
    steps = np.diff(time)
    if steps.size < 3:
        return ()
    some = steps[:: -(-steps.size // _ENOUGH)]
    low, usual, high = (float(x) for x in np.quantile(some, (0.05, 0.5, 0.95)))
    findings = []
    uneven = high - low
    limit = max(1.6 * usual, usual + 4.0 * uneven)
    gaps = np.flatnonzero(steps > limit)
    if gaps.size:
        worst = int(gaps[np.argmax(steps[gaps])])
        lost = float(np.sum(steps[gaps]) - usual * gaps.size)
        what = (
            f"{_count(gaps.size, 'gap')} in the clock, {lost:.3g} s in all"
            f" (typical step {usual:.4g} s): after {log.row} {lines_of(gaps, line_of)}"
        )
        if gaps.size > 1:
            what += f"; the longest is {steps[worst]:.4g} s after {log.row} {line_of(worst)}"
        findings.append(Finding(where, what))
    if uneven > 0.1 * usual:
        what = f"uneven clock: 90 % of the steps lie between {low:.4g} s and {high:.4g} s"
        remedy = "the times are used as recorded, without resampling"
        findings.append(Finding(where, what, remedy=remedy, minor=True))
    if (usual > 10.0 and not beside) or usual < 1e-5:
        what = f"the typical step is {usual:.3g} s and the log lasts {time[-1] - time[0]:.4g} s"
        findings.append(Finding(where, what, remedy=_unit_of_time(usual > 10.0)))
    return tuple(findings)


def impossible_clock(log: Log, longest_step: float | None = None) -> Iterator[Finding]:
    """A finding if no log of a road vehicle can have this clock, so that its unit is wrong.

    Duration or mean step is outside ``SHORTEST_LOG`` to ``LONGEST_LOG`` or ``FINEST`` to ``COARSEST``, s, or the speed
    changes by more than ``MOST_ACCELERATION`` times the duration.

    Parameters
    ----------
    log : channels in SI. longest_step : s, most that the typical step may be; None: any.
    """
    duration, where = log.duration, f"{log.name}, channel 'time'"
    usual = duration / max(log.time.size - 1, 1)
    limits = (("the log lasts", duration, SHORTEST_LOG, LONGEST_LOG), ("the mean step is", usual, FINEST, COARSEST))
    for what, value, low, high in limits:
        if not low <= value <= high:
            got = f"{what} {value:.3g} s; a road test has {low:g} to {high:g} s"
            yield Finding(where, got, remedy=_unit_of_time(value > high))
            return
    typical = float(np.median(np.diff(log.time))) if log.time.size > 1 else 0.0
    if longest_step is not None and typical > longest_step:
        what = f"the typical step is {typical:.3g} s; this test needs {longest_step:g} s or less"
        yield Finding(where, what, remedy=_unit_of_time(True))
        return
    for name in ("speed", "vehicle_speed"):
        values = log[name][np.isfinite(log[name])] if name in log else np.empty(0)
        change = float(np.subtract(*np.quantile(values, (0.9, 0.1)))) if values.size else 0.0
        if change > MOST_ACCELERATION * duration:
            rate = f"{change / duration:.3g} m/s^2, more than any car's {MOST_ACCELERATION:g} m/s^2"
            what = f"'{name}' changes by {change:.3g} m/s in {duration:.3g} s: {rate}"
            yield Finding(where, what, remedy="check the units of time and speed")


def _unit_of_time(too_long: bool) -> str:
    unit = "ms" if too_long else "s"
    return (
        f"check the unit of time; if the file's is wrong, write the correct one at the run, 'units: {{time: {unit}}}'"
    )


def lines_of(rows: Sequence[int] | NDArray[np.int64], line_of: LineOf) -> str:
    """The first line numbers of some rows as text, ``3, 4, 5, 6, ...``.

    Parameters
    ----------
    rows : (n,). line_of : row -> line of the file.
    """
    shown = ", ".join(str(line_of(int(row))) for row in rows[:_MOST_LINES])
    return shown + (", ..." if len(rows) > _MOST_LINES else "")


def _count(n: int, noun: str) -> str:
    return f"{n} {noun}" + ("s" if n != 1 else "")


def _of_too_few_digits(time: Array) -> str:
    """The remedy for a clock that repeats its times or is constant, but never steps back."""
    if not (time[1:] != time[:-1]).any():
        return "the time is constant: map the column of the clock, or export the log again"
    rate = _fixed_rate(time)
    fixed = f"; if the rate is fixed, remove 'time' and write 'reading: {{rate: {rate:g} Hz}}'" if rate else ""
    return "the time has too few digits: export it with more digits" + fixed


def _fixed_rate(time: Array) -> float:
    """The rows per second of a clock with too few digits, if most of its times occur about equally often; else 0."""
    known, counts = np.unique(time[np.isfinite(time)], return_counts=True)
    usual = float(np.median(counts)) if counts.size else 0.0
    equal = np.abs(counts - usual) <= _UNEVEN * usual
    if known.size < _FEWEST_TIMES or usual < 2.0 or np.mean(equal) < 1.0 - MOST_LATE:
        return 0.0
    return float(np.mean(counts[1:-1][equal[1:-1]]) / np.median(np.diff(known)))
