"""Reports of coast-downs as VBOX Test Suite exports them: one row a run with the times between speed levels.

The file does not state its levels: the heads of the times are empty. Equal steps between levels and the distance of
each run determine them: with times t_i between levels v - (i - 1) d and v - i d, d known,

    distance = sum t_i (v - (i - 1/2) d)
"""

from __future__ import annotations

import csv
import datetime
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from vdyn_cli.io.csv.csv_cells import number_of
from vdyn_cli.quantities.errors import Finding, InputError

Levels = Sequence[Sequence[float]]
SPEED = "level"  # name of the speed's column in the turned table
HEAD = ("Run-Use", "Heading", "Run", "Time (s)", "Distance (m)", "Start Time")
_STEPS = (5.0, 10.0, 20.0)  # km/h, between levels in use
_GRID = 5.0  # km/h: levels are multiples of it
# Of a distance: a speed between levels differs from their middle by less than 1 %, a wrong step by 5 % or more.
_CONTRADICTS = 0.02
DAY = 86400.0  # s
_KMH = 3.6


@dataclass(frozen=True)
class ReportedRun:
    """One row of a report.

    Parameters
    ----------
    used : whether the tester left the run on. heading : + or -. clock : s since midnight, NaN if not written.
    distance : m, NaN if not written. times : s for each pair of levels, NaN where they were not passed.
    """

    name: str
    used: bool
    heading: str
    clock: float
    distance: float
    times: tuple[float, ...]

    @property
    def passed(self) -> tuple[int, ...]:
        """Positions of the times that are written."""
        return tuple(i for i, t in enumerate(self.times) if np.isfinite(t))


def read_report(lines: Sequence[str]) -> tuple[ReportedRun, ...]:
    """The runs of a report; none where the lines are none."""
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
            break  # the mean, and the same runs again for each heading
        times = tuple(t if (t := number(row[i])) > 0 else float("nan") for i in columns)
        runs.append(ReportedRun(row[2], row[0] == "On", row[1], _clock(row[5]), number(row[4]), times))
    return tuple(runs)


def _clock(text: str) -> float:
    try:
        at = datetime.time.fromisoformat(text)
    except ValueError:
        return float("nan")
    return at.hour * 3600 + at.minute * 60 + at.second + 1e-6 * at.microsecond


def likely_levels(runs: Sequence[ReportedRun]) -> tuple[tuple[float, ...], ...]:
    """The speed levels, km/h, that the distances of the runs agree with; one group for each set of pairs.

    Returns
    -------
    Empty where no step of 5, 10 or 20 km/h gives levels near multiples of 5 km/h in all runs.
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
    """The first level, km/h, of a run that passed levels a step apart."""
    times = np.array([run.times[i] for i in run.passed])
    fallen = step * (np.arange(times.size) + 0.5)
    return float((run.distance * _KMH + times @ fallen) / times.sum())


def _off_grid(runs: Sequence[ReportedRun], step: float) -> float:
    """The rms distance of the first level from multiples of 5 km/h, km/h."""
    tops = np.array([_top(r, step) for r in runs])
    return float(np.sqrt(np.mean((tops - _GRID * np.round(tops / _GRID)) ** 2))) if tops.size else _GRID


def written_levels(groups: Levels) -> str:
    """Groups of speed levels, km/h, as the key ``levels`` of a description takes them; empty for none."""
    lists = ["[" + ", ".join(f"{v:g} km/h" for v in group) + "]" for group in groups]
    return lists[0] if len(lists) == 1 else f"[{', '.join(lists)}]" if lists else ""


def turned_report(runs: Sequence[ReportedRun], levels: Levels, name: str) -> list[list[str]]:
    """The report with a column for each run below the levels, as ``split_times: intervals`` reads it.

    Parameters
    ----------
    levels : m/s, groups of successive levels, in the order of the report's columns; where they are those of several
        reports, the groups of this one are those that agree with it.

    Raises
    ------
    InputError : no levels, not one more in each group than times, or levels that contradict the distances; the remedy
        names the levels that fit.
    """
    likely = written_levels(likely_levels(runs))
    fits = f"; the distances of the runs fit {likely}" if likely else ""
    count = len(runs[0].times)
    parts = [levels[i:j] for i in range(len(levels)) for j in range(i + 1, len(levels) + 1)]
    alike = [part for part in parts if sum(len(group) - 1 for group in part) == count]
    if not alike:
        what = f"states no speed levels: {count} times between levels stand in each row"
        got = f"levels for {sum(len(g) - 1 for g in levels)} times" if levels else ""
        raise InputError(Finding(name, what, got, f"write 'levels' under reading{fits}"))
    wrong = [_contradiction(runs, part) for part in alike]
    if all(wrong):
        what, got = wrong[0]
        raise InputError(Finding(name, what, got, f"correct 'levels'{fits}"))
    table = [[SPEED, *(r.name for r in runs)]]
    column = 0
    for group in alike[[bool(w) for w in wrong].index(False)]:
        table.append([f"{group[0] * _KMH:.10g}", *("" for _ in runs)])
        for level in group[1:]:
            table.append([f"{level * _KMH:.10g}", *(_cell(r.times[column]) for r in runs)])
            column += 1
    return table


def _contradiction(runs: Sequence[ReportedRun], levels: Levels) -> tuple[str, ...]:
    """What the first run's distance contradicts, and the distance by these levels; empty where none does."""
    middles = [0.5 * (a + b) for group in levels for a, b in pairwise(group)]
    for run in runs:
        covered = sum(run.times[i] * middles[i] for i in run.passed)
        if run.used and abs(covered - run.distance) > _CONTRADICTS * run.distance:
            what = f"speed levels contradict the distance of run {run.name}: {run.distance:g} m in the report"
            return what, f"levels that give {covered:.1f} m"
    return ()


def _cell(value: float) -> str:
    return f"{value:.10g}" if np.isfinite(value) else ""
