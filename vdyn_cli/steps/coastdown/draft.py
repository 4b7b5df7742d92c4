"""Lines that ``vdyn init`` adds to the channels of a coast-down: keys that no log contains, and a report's runs."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from vdyn_cli.io.csv.csv_source import open_source
from vdyn_cli.io.csv.vbox_coastdown_table import DAY, SPEED, ReportedRun, likely_levels, read_report, written_levels
from vdyn_cli.quantities.errors import InputError

DRAFT = """\
vehicle:
  mass: "?"                 # as tested, with driver and instruments, such as 1588 +- 2 kg
  rotating_mass: "?"        # wheels and driveline as mass at the tire contact, such as 60 +- 15 kg
  frontal_area: "?"         # gives the drag coefficient from the drag area, such as 2.19 m^2
  # gear_ratio, wheel_radius: needed if drive_torque is mapped
environment:
  temperature: "?"          # of the air, such as 24 degC
  pressure: "?"             # of the air at the track, not reduced to sea level, such as 98.9 kPa
"""
SETTINGS = """\
settings:                   # speed_window: [70 km/h, 25 km/h] limits the fitted part
  windows: auto             # powered: ordinary drives with a measured drive, only where it is above zero
  # road: {profile: FILE}    # surveyed positions and elevations or grades of the road, where position is logged
"""
RUN = "direction: out or back"
FALLING = "speed"  # must fall in a log without a drive signal, or the log is not a coast-down
DRIVE = ("drive_torque", "drive_force", "motor_current")


def table_runs(path: Path) -> tuple[tuple[float, float], ...]:
    """Time of day, s since midnight (NaN if unknown), and duration, s, of each run of a report; none for other files.

    Reports have one row a run.

    Parameters
    ----------
    path : any file; one that cannot be read counts as another file.
    """
    return tuple((run.clock, sum(run.times[i] for i in run.passed)) for run in _report(path))


def table_draft(paths: Sequence[Path], names: Sequence[str]) -> list[str]:
    """Description lines for channels and runs of coast-down reports with one row a run.

    Parameters
    ----------
    names : of the files as the description names them.
    """
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
    return f"  {line}" if run.used else f"  # {line}  # off in the report"


def _report(path: Path) -> tuple[ReportedRun, ...]:
    try:
        with open_source(path) as source:
            lines = b"".join(source.blocks).decode(source.encoding, "replace").splitlines()
    except InputError:  # not a text file
        return ()
    return read_report(lines)
