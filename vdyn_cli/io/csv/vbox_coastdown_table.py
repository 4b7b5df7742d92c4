"""Coast-down reports as exported by VBOX Test Suite: one row per run with the times between speed levels.

The file does not state its levels: the headers of the times are empty. If the levels are equally spaced, the distance
of each run determines them: with times t_i between levels v - (i - 1) d and v - i d, d known,

    distance = sum t_i (v - (i - 1/2) d)
"""

from __future__ import annotations

import csv
import datetime
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from vdyn_cli.io.csv.csv_cells import number_of
from vdyn_cli.quantities.errors import Finding, InputError

Levels = Sequence[Sequence[float]]
SPEED = "level"  # name of the speed column in the transposed table
HEAD = ("Run-Use", "Heading", "Run", "Time (s)", "Distance (m)", "Start Time")
_STEPS = (5.0, 10.0, 20.0)  # km/h, usual spacings of levels
_GRID = 5.0  # km/h: levels are multiples of it
# Relative error of a distance: with the mid-interval speeds it is below 1 %, with a wrong spacing 5 % or more.
_CONTRADICTS = 0.02
DAY = 86400.0  # s
_KMH = 3.6


@dataclass(frozen=True)
class ReportedRun:
    """One row of a report.

    Parameters
    ----------
    used : whether the run is switched on. heading : + or -. clock : local time, s since midnight, NaN if missing.
    distance : m, NaN if missing. times : s for each pair of levels, NaN for levels that were not passed.
    """

    name: str
    used: bool
    heading: str
    clock: float
    distance: float
    times: tuple[float, ...]

    @property
    def passed(self) -> tuple[int, ...]:
        """Indices of the recorded times."""
        return tuple(i for i, t in enumerate(self.times) if np.isfinite(t))


def read_report(lines: Sequence[str]) -> tuple[ReportedRun, ...]:
    """The runs of a report; empty if the lines are not a report."""
    at = next((i for i, line in enumerate(lines) if line.startswith(HEAD[0])), len(lines))
    delimiter = next((d for d in ",;\t" if lines[at:] and HEAD[0] + d in lines[at]), ",")
    rows = list(csv.reader(lines[at:], delimiter=delimiter))
    if not rows or tuple(rows[0][: len(HEAD)]) != HEAD:
        return ()
    decimal, head = "." if delimiter == "," else ",", rows[0]

    def number(cell: str) -> float:
        found = number_of(cell, "." if "." in cell else decimal)[0]
        return float("nan") if found is None else found

    last = head.index("Notes") if "Notes" in head else len(head)
    columns = [i for i in range(len(HEAD), last) if not head[i].strip()]
    runs: list[ReportedRun] = []
    for row in rows[1:]:
        if row[:1] not in (["On"], ["Off"]) or len(row) < last:
            break  # below are the mean, and the same runs again for each heading
        times = tuple(t if (t := number(row[i])) > 0 else float("nan") for i in columns)
        runs.append(ReportedRun(row[2], row[0] == "On", row[1], _clock(row[5]), number(row[4]), times))
    zone = _zone(lines[:at], runs[0].clock) if runs else 0.0
    return tuple(replace(run, clock=(run.clock + zone) % DAY) for run in runs)


def _zone(head: Sequence[str], first: float) -> float:
    """The whole hours, s, from the runs' starts (UTC) to local time.

    The head states a time zone and the local minute at which the logging began; the first run follows within an hour.
    """
    dates = [m for line in head if (m := re.match(r"Test Date:.*?\b(\d\d):(\d\d)\b", line))]
    zones = [line.split(",")[1].strip() for line in head if line.startswith("Time zone,")]
    begun = 3600.0 * int(dates[0][1]) + 60.0 * int(dates[0][2]) if dates else 0.0
    if not begun or not zones or zones[0] in ("", "UTC") or not np.isfinite(first):
        return 0.0
    return -3600.0 * float((first - begun + 60.0) // 3600.0)


def _clock(text: str) -> float:
    """The time of day, s; NaN for a time without seconds or hours, as a spreadsheet saves it (03:08.6)."""
    if text.count(":") != 2:
        return float("nan")
    try:
        at = datetime.time.fromisoformat(text)
    except ValueError:
        return float("nan")
    return at.hour * 3600 + at.minute * 60 + at.second + 1e-6 * at.microsecond


def likely_levels(runs: Sequence[ReportedRun]) -> tuple[tuple[float, ...], ...]:
    """The speed levels, km/h, that agree with the distances of the runs; one group for each set of passed pairs.

    Returns
    -------
    Empty if no spacing of 5, 10 or 20 km/h gives levels near multiples of 5 km/h in all runs.
    """
    groups: list[tuple[float, ...]] = []
    for passed in sorted({r.passed for r in runs if r.used and len(r.passed) > 1}):
        alike = [r for r in runs if r.used and r.passed == passed and np.isfinite(r.distance)]
        found = [(_off_grid(alike, step), step) for step in _STEPS]
        off, step = min(found, default=(1.0, 0.0))
        if not alike or off > 0.1 * _GRID:
            return ()
        top = _GRID * round(float(np.median([_top(r, step) for r in alike])) / _GRID)
        groups.append(tuple(top - step * i for i in range(len(passed) + 1)))
    return tuple(groups)


def _top(run: ReportedRun, step: float) -> float:
    """The first level, km/h, of a run whose levels are ``step`` apart."""
    times = np.array([run.times[i] for i in run.passed])
    fallen = step * (np.arange(times.size) + 0.5)
    return float((run.distance * _KMH + times @ fallen) / times.sum())


def _off_grid(runs: Sequence[ReportedRun], step: float) -> float:
    """The rms deviation of the runs' first levels from multiples of 5 km/h, km/h."""
    tops = np.array([_top(r, step) for r in runs])
    return float(np.sqrt(np.mean((tops - _GRID * np.round(tops / _GRID)) ** 2))) if tops.size else _GRID


def written_levels(groups: Levels) -> str:
    """Groups of speed levels, km/h, as the value of the key ``levels`` of a description; empty if there are none."""
    lists = ["[" + ", ".join(f"{v:g} km/h" for v in group) + "]" for group in groups]
    return lists[0] if len(lists) == 1 else f"[{', '.join(lists)}]" if lists else ""


def transposed_report(runs: Sequence[ReportedRun], levels: Levels, name: str) -> list[list[str]]:
    """The transposed report: one row per level and one column per run, the format of ``split_times: intervals``.

    Parameters
    ----------
    runs : of the report. name : of the file, for messages.
    levels : m/s, groups of successive levels, in the order of the report's columns; if they are those of several
        reports, the groups that agree with this one are used.

    Raises
    ------
    InputError : no levels, a number of levels that does not match that of the times, or levels that contradict the
        distances; the remedy states the levels that fit.
    """
    likely = written_levels(likely_levels(runs))
    count = len(runs[0].times)
    parts = [levels[i:j] for i in range(len(levels)) for j in range(i + 1, len(levels) + 1)]
    alike = [part for part in parts if sum(len(group) - 1 for group in part) == count]
    if not alike:
        what = f"states no speed levels: each row has {count} times between levels"
        got = f"levels for {sum(len(g) - 1 for g in levels)} times" if levels else ""
        fits = f"'levels: {likely}', which fits the distances of the runs," if likely else "'levels'"
        raise InputError(Finding(name, what, got, f"write {fits} under reading"))
    wrong = [_contradiction(runs, part) for part in alike]
    if all(wrong):
        what, got = wrong[0]
        remedy = f"write 'levels: {likely}', which fits the distances of the runs" if likely else "correct 'levels'"
        raise InputError(Finding(name, what, got, remedy))
    table = [[SPEED, *(r.name for r in runs)]]
    column = 0
    for group in alike[[bool(w) for w in wrong].index(False)]:
        table.append([f"{group[0] * _KMH:.10g}", *("" for _ in runs)])
        for level in group[1:]:
            table.append([f"{level * _KMH:.10g}", *(_cell(r.times[column]) for r in runs)])
            column += 1
    return table


def _contradiction(runs: Sequence[ReportedRun], levels: Levels) -> tuple[str, ...]:
    """Texts of the first run whose distance contradicts the levels, and of the distance they give; empty if none."""
    middles = [0.5 * (a + b) for group in levels for a, b in pairwise(group)]
    for run in runs:
        covered = sum(run.times[i] * middles[i] for i in run.passed)
        if run.used and abs(covered - run.distance) > _CONTRADICTS * run.distance:
            what = f"speed levels contradict the distance of run {run.name}: {run.distance:g} m in the report"
            return what, f"levels that give {covered:.1f} m"
    return ()


def _cell(value: float) -> str:
    return f"{value:.10g}" if np.isfinite(value) else ""
