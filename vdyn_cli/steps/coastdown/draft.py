"""Lines that ``vdyn init`` adds to the channels of a coast-down: keys that no log contains, and a report's runs."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Sequence
from pathlib import Path

from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.csv.csv_source import open_source
from vdyn_cli.io.csv.vbox_coastdown_table import DAY, SPEED, ReportedRun, likely_levels, read_report, written_levels
from vdyn_cli.io.formats.split_times import SplitTable, split_table
from vdyn_cli.quantities.errors import InputError

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, with driver and instruments, such as 1588 +- 2 kg
  rotating_mass: "?"        # wheels and driveline as mass at the tire contact, such as 60 +- 15 kg
  frontal_area: "?"         # gives the drag coefficient from the drag area, such as 2.19 m^2
environment:
  temperature: "?"          # of the air, such as 24 degC
  pressure: "?"             # of the air at the track, not reduced to sea level, such as 98.9 kPa
"""
_SETTINGS = """\
settings:                   # speed_window: [70 km/h, 25 km/h] limits the fitted part
  {windows}
  # road: {{profile: FILE}}    # surveyed positions and elevations or grades of the road, where position is logged
"""
SETTINGS = _SETTINGS.format(
    windows="windows: auto             # powered: ordinary drives with a measured drive, only where it is above zero"
)
SETTINGS_OF_DRIVES = _SETTINGS.format(  # where it is below zero, the brakes may be applied, too
    windows="windows: powered          # only where the measured drive is above zero; auto: all of the drive"
)
RUN = "direction: out or back"
# Any wheel that rolls freely has the car's speed, where no column is the speed or that of one unnamed wheel.
SECOND_CHOICE = {"wheel_speed": frozenset(("fl", "fr", "rl", "rr", "front", "rear", "left", "right"))}
FALLING = "speed"  # must fall in a log without a drive signal, or the log is not a coast-down
_LARGEST_TABLE = 1 << 16  # bytes: 100 levels and times of 100 runs; a larger file is not read twice
_WAYS = {
    "out": re.compile(r"(?i)\b(hin|out|forth)(fahrt)?(?![a-z])"),
    "back": re.compile(r"(?i)\b(her|back|return|zurück|zurueck|rück|rueck)(fahrt)?(?![a-z])"),
}
DRIVE = ("drive_torque", "drive_force", "motor_current", "drive_power")
_OF_TORQUE = (
    'gear_ratio: "?"           # turns of the torque sensor\'s shaft per turn of the wheel, such as 3.267',
    'wheel_radius: "?"         # effective rolling radius, such as 308 +- 0.5 mm',
)
_OF_POWER = ('driveline_efficiency: "?"  # share of the power that reaches the road, such as 0.97 +- 0.01 of a chain',)
# Lines of the vehicle with a mapped channel.
CONSTANTS_WITH = {"drive_torque": _OF_TORQUE, "motor_current": _OF_TORQUE, "drive_power": _OF_POWER}


def table_runs(path: Path) -> tuple[tuple[float, float], ...]:
    """Time of day, s since midnight (NaN if unknown), and duration, s (NaN if unknown), of each run of a report or a
    table of elapsed split times; none for other files.

    Parameters
    ----------
    path : any file; one that cannot be read counts as another file.
    """
    if (table := _split_table(path)) is not None:
        return ((math.nan, math.nan),) * len(table.times)
    return tuple((run.clock, sum(run.times[i] for i in run.passed)) for run in _report(path))


def table_draft(paths: Sequence[Path], names: Sequence[str]) -> list[str]:
    """Description lines for channels and runs of tables of split times or, if the first file is one, of coast-down
    reports with one row a run; files of the other kind are left out.

    Parameters
    ----------
    names : of the files as the description names them.
    """
    tables = [_split_table(path) for path in paths]
    kept = [k for k, table in enumerate(tables) if (table is None) == (tables[0] is None)]
    left = [f"# left out: {names[k]}, is a table of another kind" for k in range(len(names)) if k not in kept]
    if tables[0] is not None:
        return [*_split_lines([(names[k], tables[k]) for k in kept]), *left]
    return [*_report_lines([paths[k] for k in kept], [names[k] for k in kept]), *left]


def _split_lines(tables: Sequence[tuple[str, SplitTable | None]]) -> list[str]:
    """The lines for tables of elapsed split times with one column a run; columns of others than the first table are
    those of the run."""
    found = [(name, table) for name, table in tables if table is not None]
    first = found[0][1]
    body = [
        "# A table of speed levels, with one column of times for each run.",
        "reading: {split_times: elapsed}  # time since the first level",
        "channels:",
        f"  time: {{column: {json.dumps(first.times[0], ensure_ascii=False)}, unit: s}}",
        f"  speed: {{column: {json.dumps(first.levels, ensure_ascii=False)}, unit: {first.unit or json.dumps('?')}}}",
        "runs:",
    ]
    for name, table in found:
        own = "" if table.levels == first.levels else f", speed: {json.dumps(table.levels, ensure_ascii=False)}"
        for time in table.times:
            way = next((way for way, words in _WAYS.items() if words.search(time)), '"?"')
            column = f"columns: {{time: {json.dumps(time, ensure_ascii=False)}{own}}}"
            body.append(f"  - {{log: {json.dumps(name)}, direction: {way}, {column}}}")
    return body


def _split_table(path: Path) -> SplitTable | None:
    """The table of elapsed split times in a text file; None for other files."""
    if not CSV.matches(path) or path.stat().st_size > _LARGEST_TABLE:
        return None
    try:
        return split_table(list(CSV.recordings(path)))
    except InputError:
        return None


def _report_lines(paths: Sequence[Path], names: Sequence[str]) -> list[str]:
    reports = [_report(path) for path in paths]
    groups = dict.fromkeys(group for runs in reports for group in likely_levels(runs))
    levels = written_levels(list(groups)) or '"?"'
    why = "fit times and distances of the runs" if groups else "the report does not state them"
    body = [
        "# A report of coast-downs: one row a run, with the times between speed levels.",
        "reading:",
        "  split_times: intervals",
        "  split_runs: rows",
        f"  levels: {levels}  # {why}",
        "channels:",
        f"  time: {{column: {json.dumps(reports[0][0].name)}, unit: s}}",
        f"  speed: {{column: {SPEED}, unit: km/h}}",
        "runs:                       # direction: heading + is out, - is back; start: start time",
    ]
    first = reports[0][0].clock
    for name, runs in zip(names, reports, strict=True):
        body += [_row(name, run, (run.clock - first) % DAY) for run in runs]
    return body


def _row(name: str, run: ReportedRun, start: float) -> str:
    direction = {"+": "out", "-": "back"}.get(run.heading, '"?"')
    begun = f", start: {start:.3f} s" if start == start else ""
    column = f"columns: {{time: {json.dumps(run.name)}}}"
    line = f"- {{log: {json.dumps(name)}, direction: {direction}{begun}, {column}}}"
    return f"  {line}" if run.used else f"  # {line}  # excluded in the report"


def _report(path: Path) -> tuple[ReportedRun, ...]:
    try:
        with open_source(path) as source:
            lines = b"".join(source.blocks).decode(source.encoding, "replace").splitlines()
    except InputError:  # not a text file
        return ()
    return read_report(lines)
