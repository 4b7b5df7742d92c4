"""Assignment of channels to columns of a file: exact names only, suggestions for others, comparison of units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.io.column_names import MissingColumn, closest_names, positions
from vdyn_cli.io.csv.csv_cells import tidy
from vdyn_cli.io.csv.csv_layout import Layout
from vdyn_cli.io.file_units import BRACKET, contradicted_name_end, contradiction, contradicts, stated_unit, unit_problem
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import Finding


@dataclass(frozen=True)
class Match:
    """Index of each channel's column, findings, and problems."""

    position: Mapping[str, int]
    findings: tuple[Finding, ...]
    problems: tuple[Finding, ...]


def match_columns(layout: Layout, columns: Mapping[str, Column], name: str) -> Match:
    """Find each channel's column in the header of the file ``name``, and report all problems together.

    Parameters
    ----------
    layout : of the file. columns : column of each channel in the description.
    """
    position: dict[str, int] = {}
    findings: list[Finding] = []
    problems: list[Finding] = []
    for channel, column in columns.items():
        at = positions(layout.header, tidy(column.column))
        if column.group or column.source:
            problems.append(_no_groups(column, channel, name))
        elif wrong := unit_problem(column, name):
            problems.append(wrong)
        elif len(at) == 1:
            position[channel] = at[0]
            doubts = _unit_findings(layout, at[0], channel, column, name)
            # A clock in a wrong unit makes every rate wrong, and no other check detects it.
            (problems if channel == "time" and not column.of_run else findings).extend(doubts)
        elif at:
            problems.append(_repeated(column, channel, at, name))
        elif column.optional:
            what = f"channel '{channel}' is left out: no column '{column.column}'"
            findings.append(Finding(name, what, remedy=closest_names(layout.header, column.column)))
        else:
            what = f"channel '{channel}': no such column in {name}"
            suggestion = _stray_quote(layout, column.column) or closest_names(layout.header, column.column)
            problems.append(MissingColumn(column.where or name, what, repr(column.column), suggestion, channel=channel))
    return Match(position, tuple(findings), tuple(problems))


def _no_groups(column: Column, channel: str, name: str) -> Finding:
    key = "group" if column.group else "source"
    what = f"channel '{channel}': no groups or sources in the text log {name}"
    return Finding(column.where or name, what, repr(column.group or column.source), f"remove '{key}'")


def _repeated(column: Column, channel: str, at: Sequence[int], name: str) -> Finding:
    places = ", ".join(str(i + 1) for i in at)
    what = f"channel '{channel}': {len(at)} columns of this name, numbers {places}, in {name}"
    choices = " or ".join(f"'{column.column}#{n + 1}'" for n in range(min(len(at), 3)))
    return Finding(column.where or name, what, repr(column.column), f"write column: {choices}")


def _stray_quote(layout: Layout, wanted: str) -> str:
    """The remedy if a header cell differs from the wanted name only by an unpaired quote; empty otherwise."""
    if any('"' in cell and cell.replace('"', "") == tidy(wanted) for cell in layout.header):
        return f'remove the stray " in line {layout.header_line}, the header'
    return ""


def _unit_findings(layout: Layout, at: int, channel: str, column: Column, name: str) -> list[Finding]:
    """Contradictions between the description's unit and those that the file states."""
    header = layout.header[at]
    if at in layout.instants:
        place = f"{name}, column '{header}', which contains times of day"
        return [contradiction(place, channel, column, "s")] if contradicts("s", column) else []
    bracket = BRACKET.search(header)
    findings = []
    # Round brackets often contain a place or a sensor, "(L)", "(GPS)": only a unit of the same dimension counts there.
    if bracket and contradicts(bracket[2], column, only_scale=bracket[1] != "["):
        findings.append(contradiction(f"{name}, column '{header}'", channel, column, bracket[2]))
    if layout.units and contradicts(layout.units[at], column):
        findings.append(contradiction(f"{name}, column '{header}', units row", channel, column, layout.units[at]))
    if at in layout.behind and contradicts(layout.behind[at], column):
        place = f"{name}, column '{header}', unit after its numbers"
        findings.append(contradiction(place, channel, column, layout.behind[at]))
    if not unit_in_header(layout, at):
        findings += contradicted_name_end(f"{name}, column '{header}'", header, channel, column)
    return findings


def unit_in_header(layout: Layout, at: int) -> str:
    """The unit that the file states for column ``at``, in its units row or in brackets; empty if it states none.

    The unit of times of day is s, that of points of the compass deg.
    """
    if at in layout.instants or at in layout.nanoseconds:
        return "s"
    if at in layout.compass:
        return "deg"
    return stated_unit(layout.header[at], layout.units[at] if layout.units else "") or layout.behind.get(at, "")
