"""Units as a file states them, against those of the description."""

from __future__ import annotations

import re

from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import UnitError, to_si
from vdyn_cli.quantities.unit_grammar import written_powers

_UNIT = re.compile(r"[\w°%²³·*/^().\s-]{0,24}")
_DEGREES = str.maketrans({"℃": "°C", "℉": "°F"})
OTHER_UNIT = "correct the unit in the description, or make sure that the file's is wrong"  # remedy of a contradiction
BRACKET = re.compile(r"([\[({])([^\[\](){}]*)[\])}]\s*$")


def unit_text(cell: str) -> str:
    """A unit as a file writes it, without its brackets and outer or repeated blanks."""
    return " ".join(cell.translate(_DEGREES).split()).strip("[](){}<> ")


def is_unit(text: str) -> bool:
    """Whether a text from a file is a unit; what cannot be one is not given to the parser of units."""
    if _UNIT.fullmatch(text) is None:
        return False
    # m/s2, but not V2, which is a name as well.
    plain = written_powers(text) if "/" in text else text
    for same in (plain, plain.lower()):  # Deg, Km/h, Meters/second
        try:
            to_si(1.0, text, same)
        except UnitError:
            continue
        return True
    return False


def stated_unit(name: str, unit: str = "") -> str:
    """The unit that a file states for a channel, in a field of its own or in brackets; empty where it states none."""
    bracket = BRACKET.search(name)
    stated = (unit_text(unit), unit_text(bracket[2]) if bracket else "")
    return next((text for text in stated if text and is_unit(text)), "")


def contradicts(stated: str, column: Column, only_scale: bool = False) -> bool:
    """Whether a unit from a file is another one than the description's.

    Parameters
    ----------
    only_scale : units of another dimension do not count, since what stands in brackets may be no unit at all.
    """
    stated = unit_text(stated)
    if not stated or not is_unit(stated):
        return False
    try:
        file = [to_si(x, stated, column.si_unit) for x in (0.0, 1.0)]
    except UnitError:
        return not only_scale
    ours = [to_si(x, column.unit, column.si_unit) for x in (0.0, 1.0)]
    return any(abs(a - b) > 1e-9 * max(abs(a), abs(b)) for a, b in zip(file, ours, strict=True))


def contradiction(where: str, channel: str, column: Column, stated: str) -> Finding:
    """The finding that the file states another unit than the description, whose unit is used."""
    place = f" ({column.where})" if column.where else ""
    what = (
        f"channel '{channel}' is read in '{column.unit}' as the description says{place}, but the file states "
        f"another unit '{unit_text(stated)}'"
    )
    return Finding(where, what, "", OTHER_UNIT, doubt=True)


def unit_problem(column: Column, name: str) -> Finding | None:
    """What is wrong with the description's unit of a column of the log ``name``: unknown, or another dimension."""
    try:
        to_si(1.0, column.unit, column.si_unit)
    except UnitError as error:
        remedy = f"write the unit in which the file holds '{column.column}'"
        return Finding(column.where or name, str(error), "", remedy)
    return None
