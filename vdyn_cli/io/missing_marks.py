"""Numbers that loggers write where they have no value, such as -9999 and 65535."""

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


def missing_mark(values: Array) -> float | None:
    """The mark of a missing value in a channel (n,); None if there is none.

    It is one of the usual marks, the largest or smallest value, and far from all others.
    """
    written = values[np.isfinite(values)]
    if not written.size:
        return None
    for mark in {float(written.min()), float(written.max())} & _MARKS:
        others = np.abs(written[written != mark])
        if others.size and 0.0 < QUALITY.mark_ratio * float(others.max()) <= abs(mark):
            return mark
    return None
