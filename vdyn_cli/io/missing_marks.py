"""Numbers that loggers write where they have no value, such as -9999, 65535 and 655.35."""

from __future__ import annotations

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array

# Nines, and the largest and smallest integers of 16 and 32 bits, of which bus signals use the largest ones.
_MARKS = frozenset(
    [
        *(-999.0, -9999.0, -99999.0, -999999.0, 9999.0, 99999.0, 999999.0),
        *(65535.0, 65534.0, 32767.0, -32768.0, -32767.0, 4294967295.0, 2147483647.0, -2147483648.0),
    ]
)
# The same of bus signals in their units: 65535 raw counts of 0.01 km/h are 655.35 km/h, those of 1/256 km/h 255.996
# km/h (J1939), those of 1/32 K above -273 degC 1774.97 degC.
_STEPS = (10.0, 100.0, 1000.0, *(2.0**k for k in range(1, 9)))
_FULL_SCALE = np.array([*(raw / n for raw in (65535.0, 32767.0, -32768.0) for n in _STEPS), 65535.0 / 32.0 - 273.0])
_ROUNDED = 1e-6  # relative, of a value stored with 24 bits
_UNKNOWN = -1.0  # of a phone's receiver without a fix, for speed and bearing, which it writes with many digits
_DIGITS = 10.0  # per unit; the other values of such a channel are finer


def missing_mark(values: Array) -> float | None:
    """The mark of a missing value in a channel (n,); None if there is none.

    It is one of the usual marks, the largest or smallest value, and far from all others: ``mark_ratio`` times as large,
    or ``sure_mark_ratio`` times if it is the only negative value or a bus signal's largest value in its unit. -1 is
    one where all other values are positive and have several decimals.
    """
    written = values[np.isfinite(values)]
    if not written.size:
        return None
    for mark in (float(written.min()), float(written.max())):
        others = written[written != mark]
        largest = float(np.abs(others).max()) if others.size else 0.0
        if largest <= 0.0:
            continue
        alone = mark < 0.0 <= float(others.min())
        full = bool(np.isclose(_FULL_SCALE, mark, rtol=_ROUNDED, atol=0.0).any())
        usual = mark in _MARKS and abs(mark) >= QUALITY.mark_ratio * largest
        sure = (full or (mark in _MARKS and alone)) and abs(mark) >= QUALITY.sure_mark_ratio * largest
        if usual or sure or (mark == _UNKNOWN and alone and _is_fine(others)):
            return mark
    return None


def _is_fine(values: Array) -> bool:
    """Whether most values have more decimals than one."""
    tenths = values * _DIGITS
    return bool(np.median(np.abs(tenths - np.round(tenths))) > _ROUNDED * float(np.abs(tenths).max()))
