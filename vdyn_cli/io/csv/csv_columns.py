"""Which column of a file each channel means: exact names only, suggestions for the rest, units compared."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from difflib import get_close_matches

from vdyn_cli.io.csv.csv_cells import is_unit, tidy, unit_text
from vdyn_cli.io.csv.csv_layout import Layout
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import UnitError, to_si

_BRACKET = re.compile(r"([\[({])([^\[\](){}]*)[\])}]\s*$")
_NTH = re.compile(r"(.*)#(\d+)")


@dataclass(frozen=True)
class Match:
    """Position of each channel's column, what is doubtful, and what is wrong."""

    position: Mapping[str, int]
    findings: tuple[Finding, ...]
    problems: tuple[Finding, ...]


def match_columns(layout: Layout, columns: Mapping[str, Column], name: str) -> Match:
    """Find each channel's column in the header of the file ``name``, all problems together."""
    position: dict[str, int] = {}
    findings: list[Finding] = []
    problems: list[Finding] = []
    for channel, column in columns.items():
        at = _positions(layout.header, tidy(column.column))
        if wrong := _unit_problem(column, name):
            problems.append(wrong)
        elif len(at) == 1:
            position[channel] = at[0]
            findings += _unit_findings(layout, at[0], channel, column, name)
        elif at:
            problems.append(_repeated(column, channel, at, name))
        elif column.optional:
            what = f"channel '{channel}' is left out: no column '{column.column}'"
            findings.append(Finding(name, what, remedy=_suggestion(layout.header, column.column)))
        else:
            what = f"channel '{channel}': {name} has no such column"
            suggestion = _suggestion(layout.header, column.column)
            problems.append(Finding(column.where or name, what, repr(column.column), suggestion))
    return Match(position, tuple(findings), tuple(problems))


def _positions(header: Sequence[str], wanted: str) -> list[int]:
    at = [i for i, cell in enumerate(header) if cell == wanted]
    if at or (nth := _NTH.fullmatch(wanted)) is None:
        return at
    same = [i for i, cell in enumerate(header) if cell == nth[1].rstrip()]
    return same[int(nth[2]) - 1 :][:1] if int(nth[2]) > 0 else []


def _repeated(column: Column, channel: str, at: Sequence[int], name: str) -> Finding:
    places = ", ".join(str(i + 1) for i in at)
    what = f"channel '{channel}': {name} has {len(at)} columns of this name, numbers {places}"
    choices = " or ".join(f"'{column.column}#{n + 1}'" for n in range(min(len(at), 3)))
    return Finding(column.where or name, what, repr(column.column), f"write column: {choices}")


def _suggestion(header: Sequence[str], wanted: str) -> str:
    """The closest names: first those that differ in case, blanks or unit alone."""
    named = [cell for cell in dict.fromkeys(header) if cell]
    same = [cell for cell in named if _bare(cell) == _bare(wanted)]
    bare = {_bare(cell): cell for cell in reversed(named)}
    near = same or [bare[b] for b in get_close_matches(_bare(wanted), list(bare), n=3, cutoff=0.6)]
    if near:
        return "did you mean " + " or ".join(f"'{cell}'" for cell in near[:3]) + "?"
    shown = ", ".join(f"'{cell}'" for cell in named[:12])
    return f"its columns are {shown}" + (f" and {len(named) - 12} more" if len(named) > 12 else "")


def _bare(name: str) -> str:
    return re.sub(r"[\W_]+", "", _BRACKET.sub("", name).casefold()) or name


def _unit_problem(column: Column, name: str) -> Finding | None:
    try:
        to_si(1.0, column.unit, column.si_unit)
    except UnitError as error:
        remedy = f"write the unit in which the file holds '{column.column}'"
        return Finding(column.where or name, str(error), "", remedy)
    return None


def _unit_findings(layout: Layout, at: int, channel: str, column: Column, name: str) -> list[Finding]:
    """Contradictions between the unit of the description and those that the file states."""
    bracket = _BRACKET.search(layout.header[at])
    findings = []
    # Round brackets often hold a place or a sensor, "(L)", "(GPS)": only a unit of the same kind counts there.
    if bracket and _contradict(bracket[2], column, only_scale=bracket[1] != "["):
        findings.append((f"column '{layout.header[at]}'", bracket[2]))
    if layout.units and _contradict(layout.units[at], column, only_scale=False):
        findings.append((f"column '{layout.header[at]}', units row", layout.units[at]))
    where = f" ({column.where})" if column.where else ""
    what = (
        f"channel '{channel}' is read in '{column.unit}' as the description says{where}, but the file states "
        "another unit"
    )
    remedy = "correct the unit in the description, or make sure that the file's is wrong"
    return [
        Finding(f"{name}, {place}", f"{what} '{unit_text(unit)}'", "", remedy, doubt=True) for place, unit in findings
    ]


def _contradict(stated: str, column: Column, only_scale: bool) -> bool:
    stated = unit_text(stated)
    if not stated or not is_unit(stated):
        return False
    try:
        file = [to_si(x, stated, column.si_unit) for x in (0.0, 1.0)]
    except UnitError:
        return not only_scale
    ours = [to_si(x, column.unit, column.si_unit) for x in (0.0, 1.0)]
    return any(abs(a - b) > 1e-9 * max(abs(a), abs(b)) for a, b in zip(file, ours, strict=True))


def unit_in_header(layout: Layout, at: int) -> str:
    """The unit that the file states for a column, in its units row or in brackets; empty where it states none."""
    bracket = _BRACKET.search(layout.header[at])
    stated = [unit_text(layout.units[at])] if layout.units else []
    stated += [unit_text(bracket[2])] if bracket else []
    return next((unit for unit in stated if unit and is_unit(unit)), "")
