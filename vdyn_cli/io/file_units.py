"""Units that a file states, compared with those of the description."""

from __future__ import annotations

import re
from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import lru_cache

from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import UnitError, has_gain, is_spelling, raw_scale, to_si
from vdyn_cli.quantities.unit_grammar import written_powers

_UNIT = re.compile(r"[\w°%²³·*/^().\s-]{0,24}")
_SIGNS = str.maketrans({"℃": "°C", "℉": "°F"})
_OTHER_WORDS = {
    "m_sec2": "m/s2",  # of Car Scanner
    "*C": "°C",  # of VCDS
    **{"км/ч": "km/h", "м/с": "m/s", "об/мин": "1/min", "公里/小时": "km/h", "千米/小时": "km/h", "转/分": "1/min"},
    **{"km/u": "km/h", "km/t": "km/h", "km/sa": "km/h"},  # Dutch, Danish and Norwegian, Turkish
    **{"N•m": "N m", "N-m": "N m", "N.m": "N m"},
}
_WHEELS = frozenset(("FL", "FR", "RL", "RR", "VL", "VR", "HL", "HR"))  # corners of a car, not femto- or hectoliters
_NAME_ENDS = {  # units as the last word of a name
    **{"mps": "m/s", "kmh": "km/h", "kph": "km/h", "kmph": "km/h", "mph": "mph", "mps2": "m/s^2", "ms2": "m/s^2"},
    **{"rpm": "rpm", "radps": "rad/s", "degps": "deg/s", "dps": "deg/s", "deg": "deg", "nm": "N m", "kn": "kN"},
    **{"knm": "kN m", "dan": "daN", "danm": "daN m", "cn": "cN", "cnm": "cN m", "mv": "mV", "pct": "%", "percent": "%"},
    **{"kg": "kg", "lbs": "lbs", "n": "N", "m": "m", "mm": "mm", "km": "km", "ft": "ft", "s": "s", "ms": "ms"},
    **dict.fromkeys(("mile", "miles"), "mile"),
    **dict.fromkeys(("knot", "knots", "kts"), "knot"),
}
# Units in words at the end of a name, such as speed_meters_per_sec and vel_m_s.
_IN_WORDS = (
    (re.compile(r"(?<![^\W_])(m|rad|deg)[_ ]s(?:[_ ]?(2))?$", re.IGNORECASE), r"\1ps\2"),
    (re.compile(r"(?<![^\W_])(km|n)[_ ]([hm])$", re.IGNORECASE), r"\1\2"),
    (re.compile(r"kN$"), "kn"),  # not a name that ends with k, in N
    (re.compile(r"kN[_ ]?m$"), "knm"),
    (re.compile(r"daN[_ ]?(m?)$"), r"dan\1"),
    (re.compile(r"(?<![^\W_])cN[_ ]?(m?)$"), r"cn\1"),
    (re.compile(r"(?<![^\W_])mV$"), "mv"),
    (re.compile(r"kilomet(er|re)s?[ _]?per[ _]?h(ou)?r?$", re.IGNORECASE), "kmh"),
    (re.compile(r"met(er|re)s?[ _]?per[ _]?s(ec(ond)?)?$", re.IGNORECASE), "mps"),
    (re.compile(r"miles?[ _]?per[ _]?h(ou)?r?$", re.IGNORECASE), "mph"),
)
_NUMBER = re.compile(r"\d[\d.]*\s*(?=[^\W\d])")  # before a unit: of Tick[10ms], ms is not the unit
# German compounds are split; others, such as Winkelgeschwindigkeit, name other quantities.
_COMPOUND = re.compile(
    r"(?<![a-zäöü])(fahrzeug|fahr|laengs|längs|quer|vertikal|rad|motor|wind|antriebs|brems|weg)"
    r"(?=geschw|beschl|drehzahl|drehmoment|moment|kraft|druck|strecke)",
    re.IGNORECASE,
)
_DEVICE = re.compile(r"(?<![A-Za-z])(GPS|GNSS|CAN|OBD|IMU)(?=[a-z]{3})")  # GPSvel
# At the end of a name, or before the mark of a device: "Vehicle Speed (km/h) *OBD".
BRACKET = re.compile(r"([\[({])([^\[\](){}]*)[\])}]\s*(?:\*\w+\s*)?$")


def unit_text(cell: str) -> str:
    """A unit as a file writes it, without brackets and without outer or repeated blanks."""
    text = " ".join(cell.translate(_SIGNS).split()).strip("[](){}<> ")
    return _OTHER_WORDS.get(text, text)


@lru_cache(maxsize=1024)
def is_unit(text: str) -> bool:
    """Whether a text from a file is a unit; impossible texts are not passed to the parser of units."""
    if _UNIT.fullmatch(text) is None or text in _WHEELS:
        return False
    text = raw_scale(text)[1]
    if is_spelling(text):
        return True
    # m/s2, but not V2, which may be a name.
    plain = written_powers(text) if "/" in text else text
    for same in (plain, plain.lower()):  # Deg, Km/h, Meters/second
        try:
            to_si(1.0, text, same)
        except UnitError:
            continue
        return True
    return False


def is_unit_of(text: str, si_unit: str) -> bool:
    """Whether a text from a file is a unit of the dimension of ``si_unit``."""
    try:
        return is_unit(unit_text(text)) and to_si(1.0, unit_text(text), si_unit) != 0.0
    except UnitError:
        return False


def stated_unit(name: str, unit: str = "") -> str:
    """The unit that a file states for a channel, in a separate field or in brackets of its name; empty if none."""
    bracket = BRACKET.search(name)
    stated = (unit_text(unit), unit_text(bracket[2]) if bracket else "")
    return next((text for text in stated if text and is_unit(text)), "")


def words_and_unit(name: str) -> tuple[tuple[str, ...], str]:
    """The words of a name in lower case, and the unit stated by its last word, which is not among them; or empty."""
    plain = re.sub(
        r"[\[({]([^\[\](){}]*)[\])}]",
        lambda bracket: " " if is_unit(_NUMBER.sub("", unit_text(bracket[1]))) else f" {bracket[1]} ",
        name,
    )
    plain = re.sub(r"#\d+\s*$", "", plain).strip()
    for written, short in _IN_WORDS:
        plain = written.sub(f" {short}", plain)
    before, _, last = plain.rpartition(" ")
    if before and "/" in last and is_unit(unit_text(last)):
        return words_and_unit(before)[0], unit_text(last)
    plain = _DEVICE.sub(r"\1 ", plain)
    plain = _COMPOUND.sub(r"\1 ", plain)
    split = re.findall(r"[A-Z]{2,}(?![a-zäöü])\d*|[A-Z](?=[A-Z][a-zäöü])|[A-ZÄÖÜ]?[a-zäöü]+\d*|[A-Z]+\d*", plain)
    lower = tuple(w.lower() for w in split)
    unit = _NAME_ENDS.get(lower[-1], "") if len(lower) > 1 else ""
    return (lower[:-1] if unit else lower), unit


def contradicted_name_end(where: str, name: str, channel: str, column: Column) -> list[Finding]:
    """The contradiction between the description's unit and the end of a name, such as ``spd_mph``, if there is one.

    For channels whose file states no unit elsewhere. A single letter (``_m``, ``_s``) or a unit of another dimension
    may be an abbreviation of something else and contradicts nothing; but a ``g`` of an acceleration is one.
    """
    words, unit = words_and_unit(name)
    if column.si_unit == "m/s^2" and len(words) > 1 and words[-1] == "g":
        unit = "g"
    elif len(unit) < 2:
        return []
    if not contradicts(unit, column, only_scale=True):
        return []
    return [contradiction(f"{where}, end of its name", channel, column, unit)]


def contradicts(stated: str, column: Column, only_scale: bool = False) -> bool:
    """Whether the unit that a file states differs from the description's.

    Parameters
    ----------
    stated : text of the file's unit.
    column : the description's column.
    only_scale : ignore units of another dimension, since a text in brackets may not be a unit.
    """
    stated = unit_text(stated)
    if not stated or not is_unit(stated):
        return False
    try:
        file = [to_si(x, stated, column.si_unit) for x in (0.0, 1.0)]
    except UnitError:
        return not (only_scale or has_gain(column.unit))  # 48 N m for each bar
    ours = [to_si(x, column.unit, column.si_unit) for x in (0.0, 1.0)]
    return any(abs(a - b) > 1e-9 * max(abs(a), abs(b)) for a, b in zip(file, ours, strict=True))


@dataclass(frozen=True)
class UnitContradiction(Finding):
    """The finding that a file states another unit than the description.

    Parameters
    ----------
    channel : its name. read, stated : the units of the description, which is used, and of the file.
    """

    channel: str = field(default="", compare=False)
    read: str = field(default="", compare=False)
    stated: str = field(default="", compare=False)


def contradiction(where: str, channel: str, column: Column, stated: str) -> Finding:
    """The finding that the file ``where`` states another unit than the description, whose unit is used: a note if it is
    stated for the run, otherwise a warning."""
    place = f" ({column.where})" if column.where else ""
    unit = unit_text(stated)
    what = (
        f"channel '{channel}' is read in '{column.unit}' as the description says{place}, but the file states "
        f"another unit '{unit}'"
    )
    remedy = (
        f"correct the unit in the description; if the file's is wrong, write 'units: {{{channel}: {column.unit}}}' "
        "at the run"
    )
    if _other_dimension(unit, column.si_unit):
        raw = _gain_of(column.unit, unit) if channel != "time" else ""
        remedy = f"map '{channel}' to its own column: '{unit}' is not a unit of '{channel}'; {raw}{remedy}"
    found = UnitContradiction(where, what, channel=channel, read=column.unit, stated=unit)
    return found if column.of_run else replace(found, remedy=remedy, doubt=True)


def _gain_of(unit: str, reading: str) -> str:
    return f"if it is a sensor's reading, write its gain, such as '0.5 {unit}' for 0.5 {unit} in 1 {reading}; "


def _other_dimension(unit: str, si_unit: str) -> bool:
    try:
        to_si(1.0, unit, si_unit)
    except UnitError:
        return True
    return False


def wrong_units(findings: Iterable[Finding]) -> tuple[UnitContradiction, ...]:
    """Those findings that state a contradiction of units, the likely cause of whatever else is wrong with a log."""
    return tuple(f for f in findings if isinstance(f, UnitContradiction) and f.doubt)


def unit_problem(column: Column, name: str) -> Finding | None:
    """The problem if the description's unit for a column of the log ``name`` is unknown or has another dimension."""
    try:
        to_si(1.0, column.unit, column.si_unit)
    except UnitError as error:
        remedy = remedy_for_unit(column.unit, column.si_unit) or (
            f"write the unit in which '{column.column}' is logged; where the values are multiples of a unit, "
            f"write the factor before it, such as '0.1 {column.si_unit}'"
        )
        return Finding(column.where or name, str(error), "", remedy)
    return None


def remedy_for_unit(unit: str, si_unit: str) -> str:
    """The remedy for a unit of another dimension that loggers write for a quantity; empty for other units.

    A speed of a wheel in a unit of speed, which brake controls send; a sensor's voltage; the pressure of
    a brake in place of its torque.
    """
    if is_unit_of(unit, "V") or (si_unit == "N m" and is_unit_of(unit, "Pa")):
        return _gain_of(si_unit, unit).rstrip("; ")
    if si_unit == "rad/s" and is_unit_of(unit, "m/s"):
        return "map a wheel's speed over the ground as 'speed', if the test reads 'speed'"
    return ""
