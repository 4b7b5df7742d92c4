"""What a slope takes."""

from __future__ import annotations

from vdyn_cli.engine.bench import Number, Signals
from vdyn_cli.engine.maths import GRAVITY, sqrt


def climb(s: Signals) -> Number:
    """Weight along the road, N, positive uphill.

    M g sin(atan(i)) = M g i / sqrt(1 + i^2)

    Parameters
    ----------
    s : mass kg, grade i (rise over run).
    """
    return s.mass * GRAVITY * s.grade / sqrt(1.0 + s.grade**2)
