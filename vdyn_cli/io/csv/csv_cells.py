"""Interpretation of one table cell: a name, nothing, or a number."""

from __future__ import annotations

import re

LONGEST_NUMBER = 400  # characters of a cell that can be a number: the longest float64 in plain digits has some 330

NOT_WRITTEN = frozenset(
    {
        *("", "-", "--", "---", "----", "-----", "?", "*", "nan", "na", "n/a", "n.a.", "#n/a", "null", "none", "<na>"),
        *("-nan", "-nan(ind)", "1.#qnan", "-1.#ind", "nodata", "no data", "#value!", "#ref!", "#div/0!", "#num!"),
        *("#nv", "#wert!", "#bezug!", "#zahl!", "#valeur!", "#nombre!", "#n/d", "#n/v"),  # Excel in other languages
    }
)

_NUMBER = re.compile(
    r"""[+-]?\s*(?:
        \d+(?:[eE][+-]?\d+)?                                     # 12, 1e5
      | (?:(?P<dot>\d+(?:,\d{3})*\.\d*|\.\d+)                   # 1.5, 1,234.5
          |(?P<comma>\d+(?:\.\d{3})*,\d*|,\d+))(?:[eE][+-]?\d+)?  # 1,5, 1.234,5
      | inf | infinity
    )""",
    re.VERBOSE | re.IGNORECASE,
)
_GROUPED = {
    ".": re.compile(r"[+-]?\d{1,3}(,\d{3})+\.\d*"),  # 1,234.5
    ",": re.compile(r"[+-]?\d{1,3}(\.\d{3})+,\d*"),  # 1.234,5
}
_WHOLE_GROUPS = {  # in a file with the other mark as the decimal one: 12,345
    ".": re.compile(r"[+-]?[1-9]\d{0,2}(,\d{3})+"),
    ",": re.compile(r"[+-]?[1-9]\d{0,2}(\.\d{3})+"),
}
_BEFORE_UNIT = re.compile(r"([+-]?\d[\d.,]*(?:[eE][+-]?\d+)?)\s*([^\W\d_][^\s,;]*|[%°][^\s,;]*)")
_SIGN_APART = re.compile(r"(?<=^[+-])\s+")  # + 0.51, as strip-chart recorders write it
_POINTS = "N NNE NE ENE E ESE SE SSE S SSW SW WSW W WNW NW NNW"
COMPASS = {point: 22.5 * k for k, point in enumerate(_POINTS.split())}  # deg from north
_TRUTH = {"true": 1.0, "false": 0.0}


def tidy(name: str) -> str:
    """A header cell without outer or repeated blanks and line breaks."""
    return " ".join(name.split())


def is_written(text: str) -> bool:
    """Whether a cell has a value other than the usual marks of a missing one."""
    return text.strip().lower() not in NOT_WRITTEN


def is_number(text: str) -> bool:
    """Whether a cell is a number, with either decimal mark."""
    return len(text) <= LONGEST_NUMBER and _NUMBER.fullmatch(text.strip()) is not None


def with_unit(text: str) -> tuple[str, str] | None:
    """The number and the unit of a cell such as ``35 km/h``; None for other cells.

    Whether the text behind the number is a unit is not examined.
    """
    found = _BEFORE_UNIT.fullmatch(text.strip()) if len(text) <= LONGEST_NUMBER else None
    return (found[1], found[2]) if found is not None and is_number(found[1]) else None


def decimal_mark(text: str) -> str:
    """The decimal mark of a number; empty for a whole number or no number."""
    match = _NUMBER.fullmatch(text.strip()) if len(text) <= LONGEST_NUMBER else None
    if match is None:
        return ""
    return "." if match["dot"] else "," if match["comma"] else ""


def may_be_thousands(text: str) -> bool:
    """Whether the commas of a number may be thousands separators of a whole number: ``1,234`` is 1234 or 1.234."""
    return len(text) <= LONGEST_NUMBER and _WHOLE_GROUPS["."].fullmatch(text.strip()) is not None


def number_of(text: str, decimal: str) -> tuple[float | None, bool]:
    """The number in a cell (None if it is not one) with the mark ``decimal``, and whether it had thousands separators.
    True and false are 1 and 0. A whole number with thousands separators, ``1,234``, is one only if other numbers show
    the mark; without a ``decimal`` (empty: a point is the mark) it is ambiguous and no number.
    """
    shown, decimal = bool(decimal), decimal or "."
    text = _SIGN_APART.sub("", text.strip())
    if len(text) > LONGEST_NUMBER:
        return None, False
    separator = "," if decimal == "." else "."
    grouped = any(form[decimal].fullmatch(text) for form in (_GROUPED, *([_WHOLE_GROUPS] if shown else [])))
    if grouped:
        text = text.replace(separator, "")
    if separator in text or "_" in text:
        return None, False
    try:
        return float(text.replace(decimal, ".")), grouped
    except ValueError:
        return _TRUTH.get(text.lower()), False
