"""Conversion factors of common units, so that most processes need not load the unit library.

A test compares every entry with the unit library; units that are not listed are converted by the library.
"""

from __future__ import annotations

from math import pi

# Units that need no conversion, in the spelling of the vocabulary.
_SAME = frozenset(
    {
        *("", "s", "m", "m/s", "m/s^2", "m/s^3", "m^2", "rad", "rad/s", "deg", "deg/s", "km/h", "mm"),
        *("kg", "kg m^2", "kg/m^3", "N", "N m", "N/m", "N s/m", "N s^2/m^2", "N m/rad", "N m s/rad"),
        *("K", "Pa", "1/N", "1/rad"),
    }
)

# (unit, SI unit): (factor, offset) with SI value = factor * value + offset.
_FACTORS = {
    ("km/h", "m/s"): (1 / 3.6, 0.0),
    ("kph", "m/s"): (1 / 3.6, 0.0),
    ("mph", "m/s"): (0.44704, 0.0),
    ("kn", "m/s"): (1852 / 3600, 0.0),
    ("mm", "m"): (1e-3, 0.0),
    ("cm", "m"): (1e-2, 0.0),
    ("km", "m"): (1e3, 0.0),
    ("ft", "m"): (0.3048, 0.0),
    ("mile", "m"): (1609.344, 0.0),
    ("ms", "s"): (1e-3, 0.0),
    ("min", "s"): (60.0, 0.0),
    ("h", "s"): (3600.0, 0.0),
    ("deg", "rad"): (pi / 180, 0.0),
    ("deg/s", "rad/s"): (pi / 180, 0.0),
    ("rpm", "rad/s"): (pi / 30, 0.0),
    ("1/min", "rad/s"): (pi / 30, 0.0),
    ("g", "m/s^2"): (9.80665, 0.0),
    ("Nm", "N m"): (1.0, 0.0),
    ("kNm", "N m"): (1e3, 0.0),
    ("kN", "N"): (1e3, 0.0),
    ("hPa", "Pa"): (1e2, 0.0),
    ("kPa", "Pa"): (1e3, 0.0),
    ("bar", "Pa"): (1e5, 0.0),
    ("GPa", "Pa"): (1e9, 0.0),
    ("degC", "K"): (1.0, 273.15),
    ("%", ""): (1e-2, 0.0),
}


def common_factor(unit: str, si_unit: str) -> tuple[float, float] | None:
    """Factor and offset with SI value = factor * value + offset; None where the pair is not listed."""
    return (1.0, 0.0) if unit == si_unit and unit in _SAME else _FACTORS.get((unit, si_unit))
