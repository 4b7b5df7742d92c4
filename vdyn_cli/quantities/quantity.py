"""Physical quantities, and conversion of units to and from SI. The only module that uses pint."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from functools import cache
from typing import TYPE_CHECKING, Any, TypeVar

from vdyn_cli.quantities import unit_grammar
from vdyn_cli.quantities.common_units import common_factor

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray
    from pint import UnitRegistry

    Values = TypeVar("Values", float, NDArray[np.float64])


class UnitError(ValueError):
    """A unit is unknown, or has another dimension than the quantity."""


@dataclass(frozen=True)
class Quantity:
    """A physical quantity: its name in files, SI unit, meaning and physical range.

    ``lower`` and ``upper`` are wide limits for cars and their sensors, to detect a wrong unit or a misplaced decimal
    point, not to constrain a fit.
    """

    name: str
    unit: str
    meaning: str
    symbol: str = ""
    lower: float = -math.inf
    upper: float = math.inf

    def allows(self, value: float) -> bool:
        """Whether a value in the SI unit lies within the range, including its ends."""
        return self.lower <= value <= self.upper

    @property
    def range_text(self) -> str:
        """The physical range as text: ``0 to 3 kg``."""
        return f"{self.lower:g} to {self.upper:g} {self.unit}".strip()


# Spellings that test benches use and that pint reads otherwise ("Nm" is its number-meter) or not at all.
_SPELLINGS = (
    "newton_meter = newton * meter = Nm",
    "kilonewton_meter = 1000 newton * meter = kNm",
    "kilogram_meter_squared = kilogram * meter ** 2 = kgm2",
)

LONGEST_QUANTITY = 100  # characters of a quantity: a number of full precision, its deviation, and a unit have some 90
_BY_KIND = {
    **{("mb", "Pa"): "mbar", ("c", "K"): "degC", ("f", "K"): "degF"},
    **{
        ("g", "m/s^2"): "g_0",
        ("lb", "N"): "lbf",
        ("lbs", "N"): "lbf",
        ("kg", "N"): "kgf",
        ("kn", "N"): "kN",
        ("nm", "N m"): "N*m",
    },
    **{(u, "m/s"): "km/h" for u in ("kmh", "kmph", "km/hr")},
    **{(u, "rad/s"): "rpm" for u in ("1/min", "/min", "min^-1", "min-1", "u/min", "rev/min", "r/min", "tr/min")},
    **{(u, "N m"): "lbf*ft" for u in ("lb-ft", "ft-lb", "lb ft", "ft lb", "lbft", "ftlb")},
}

_UNIT_BEHIND = r"[ *x·]{0,3}((?:[^\W\d_⁰¹²³⁴-⁹]|[%°]).*)"
_RAW = re.compile(rf"\s*(\d{{0,3}}\.\d{{1,12}}){_UNIT_BEHIND}", re.DOTALL)
_GAIN = re.compile(rf"\s*(\d{{1,6}}(?:\.\d{{1,12}})?|\.\d{{1,12}}){_UNIT_BEHIND}", re.DOTALL)  # in a description

_CASE_MATTERS = frozenset(("kN",))  # not the knot

_KINDS = {
    "m": "length",
    "m^2": "area",
    "s": "time",
    "kg": "mass",
    "K": "temperature",
    "A": "current",
    "rad": "angle",
    "m/s": "speed",
    "m/s^2": "acceleration",
    "m/s^3": "jerk",
    "rad/s": "angular speed",
    "N": "force",
    "N m": "torque",
    "Pa": "pressure",
    "kg m^2": "moment of inertia",
    "kg/m^3": "density",
    "N/m": "stiffness",
    "N s/m": "damping",
    "N m/rad": "torsional stiffness",
    "N m s/rad": "torsional damping",
}


def is_spelling(text: str) -> bool:
    """Whether a text is one of the spellings whose unit depends on what is measured, such as ``lb-ft``."""
    return text.lower() in {spelling for spelling, _ in _BY_KIND}


def raw_scale(text: str) -> tuple[float, str]:
    """The decimal factor and the unit of a raw value's unit, such as 0.01 and km/h of ``0.01 km/h``; 1 without one."""
    return _factor_and_unit(_RAW, text)


def has_gain(unit: str) -> bool:
    """Whether a description's unit has a factor, the gain of a sensor: ``48 N m`` for 48 N m in each 1 of the file."""
    return _factor_and_unit(_GAIN, unit)[1] != unit


def _factor_and_unit(form: re.Pattern[str], text: str) -> tuple[float, str]:
    found = form.fullmatch(text[: unit_grammar.LONGEST_UNIT])
    return (float(found[1]), found[2]) if found is not None and float(found[1]) > 0.0 else (1.0, text)


@cache
def _registry() -> UnitRegistry[Any]:
    from pint import UnitRegistry

    registry: UnitRegistry[Any] = UnitRegistry(autoconvert_offset_to_baseunit=True)
    for spelling in _SPELLINGS:
        registry.define(spelling)
    return registry


@cache
def _scale(unit: str, si_unit: str) -> tuple[float, float]:
    """Factor and offset with SI value = factor * value + offset."""
    return common_factor(unit, si_unit) or _read_scale(unit, si_unit)


def _read_scale(unit: str, si_unit: str) -> tuple[float, float]:
    """The same as ``_scale``, from the unit library; a factor before the unit is a raw value's: ``0.01 km/h``."""
    step, plain = _factor_and_unit(_GAIN, unit)
    if plain != unit:
        factor, offset = _scale(plain, si_unit)
        return step * factor, offset
    # An accelerometer's "g" is standard gravity, not the gram; a rotating shaft's "1/min" counts revolutions; "lb" of a
    # force is pound-force.
    text = _BY_KIND.get((unit[: unit_grammar.LONGEST_UNIT].strip().lower(), si_unit), unit)
    text = unit_grammar.written_products(text)
    if wrong := unit_grammar.why_no_unit(text):
        raise UnitError(f"'{unit[:40]}' {wrong}")
    # "kgm2" is a defined name, "m/s2" is not; loggers write RPM, KM/H and MPH, which are units in lower case.
    spellings = dict.fromkeys((text, unit_grammar.written_powers(text), unit_grammar.written_powers(text).lower()))
    spellings = {s: None for s in spellings if s == text or text not in _CASE_MATTERS}
    is_unit = False  # of another dimension: "N" is one, "n" is not
    for spelling in spellings:
        try:
            factor, offset = _by_library(spelling, si_unit)
            break
        except Exception as error:  # pint raises many kinds, also tokenizer errors
            is_unit = is_unit or type(error).__name__ == "DimensionalityError"
    else:
        raise UnitError(f"'{unit}' is not {a_unit_of(si_unit) if is_unit else 'a unit'}")
    if factor == 0.0 or not (math.isfinite(factor) and math.isfinite(offset)):
        raise UnitError(f"'{unit}' is not a unit")
    return factor, offset


def _by_library(unit: str, si_unit: str) -> tuple[float, float]:
    """The same as ``_scale``; raises the library's exceptions."""
    quantity = _registry().Quantity
    zero, one = (quantity(x, unit or "1").to(si_unit or "1").magnitude for x in (0.0, 1.0))
    return float(one - zero), float(zero)


def a_unit_of(si_unit: str) -> str:
    """The kind of unit in words: "a unit of speed (m/s)"; "a plain number or %" for an empty unit."""
    if not si_unit:
        return "a plain number or %"
    kind = _KINDS.get(si_unit)
    return f"a unit of {kind} ({si_unit})" if kind else f"a unit that can be converted to {si_unit}"


def to_si(values: Values, unit: str, si_unit: str) -> Values:
    """Convert values in ``unit`` to ``si_unit``; exact for equal units.

    Raises
    ------
    UnitError : unknown unit, or another dimension.
    """
    factor, offset = _scale(unit, si_unit)
    if factor == 1.0 and offset == 0.0:
        return values
    return values * factor + offset  # type: ignore[operator, no-any-return, unused-ignore]


def from_si(values: Values, unit: str, si_unit: str) -> Values:
    """Convert SI values to ``unit``, the inverse of :func:`to_si`."""
    factor, offset = _scale(unit, si_unit)
    return (values - offset) / factor  # type: ignore[operator, no-any-return, unused-ignore]


_NUMBER = r"[+-]?(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?"
_PLUS_MINUS = r"(?:\+-|\+/-|±)"
_MEASURED = re.compile(rf"^\s*({_NUMBER})\s*(?:{_PLUS_MINUS}\s*({_NUMBER}))?\s*(.*?)\s*$")
_DEVIATION = re.compile(rf"^(.*?)\s*{_PLUS_MINUS}\s*({_NUMBER})\s*(.*)$")  # behind a number: its unit, +- 1 %


@dataclass(frozen=True)
class Given:
    """A number stated by the user, in SI, with its standard deviation (0: exact)."""

    value: float
    std: float = 0.0


def parse(text: str | float, si_unit: str) -> Given:
    """Read ``70 km/h``, ``1588 +- 5 kg``, ``1588 kg +- 0.3 %`` or a plain SI number, and convert it to ``si_unit``.

    Raises
    ------
    UnitError : not a number with a unit, unknown unit, another dimension, a negative standard deviation, or a number
        that is not finite.
    """
    if isinstance(text, (int, float)) and not isinstance(text, bool):
        return _finite(text, 0.0, str(text))
    text = str(text)
    match = _MEASURED.match(text) if len(text) <= LONGEST_QUANTITY else None
    if match is None:
        raise UnitError(f"'{text[:40]}' is not a number with a unit, such as '1 {si_unit}'")
    number, spread, unit = match.groups()
    own = ""  # unit of the standard deviation, where it has one
    if re.match(r",\d", unit) and not spread:
        raise UnitError(f"'{text[:40]}' has a {_without_comma(number, unit[1:])}")
    if not spread and (behind := _DEVIATION.match(unit)):
        unit, spread, own = behind.groups()
    if has_gain(unit):
        raise UnitError(f"'{text[:40]}' has two numbers: if the second is a standard deviation, write '+-' before it")
    std = float(spread or 0.0)
    if std < 0.0:
        right = " ".join([number, *([unit, "+-", f"{-std:g}", own] if own else ["+-", f"{-std:g}", unit])]).rstrip()
        raise UnitError(f"'{text[:40]}' has a negative standard deviation: write {right[:60]}")
    factor, offset = _scale(unit or si_unit, si_unit)
    if own == "%" and unit != "%":
        std *= abs(float(number)) / 100.0 * factor
    else:
        std *= _scale(own, si_unit)[0] if own else factor
    return _finite(float(number) * factor + offset, std, text)


def _without_comma(number: str, rest: str) -> str:
    """How to write a number with a comma: three digits behind it may be thousands."""
    if re.match(r"\d{3}(?!\d)", rest):
        return f"comma: write {number}{rest[:30]}, or {number}.{rest[:30]} if it is a decimal comma"
    return f"decimal comma: write {number}.{rest[:30]}"


def _finite(value: float, std: float, text: str) -> Given:
    """The number; UnitError if it or its standard deviation is not finite."""
    try:
        found = Given(float(value), std)
    except OverflowError:  # an integer of more than 308 digits
        found = Given(math.inf)
    if not (math.isfinite(found.value) and math.isfinite(found.std)):
        raise UnitError(f"'{text[:40]}' is not a finite number")
    return found
