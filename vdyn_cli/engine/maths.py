"""The functions that element laws may use, for floats and CasADi symbols alike.

``where(condition, a, b)`` computes both sides, so both must be defined everywhere. A power with a fractional exponent
is not defined below zero. At a tie the slope of fmax and fmin is the mean of both sides; that of fabs at 0 is 0.
"""

from __future__ import annotations

from typing import Any

import casadi as ca

sin, cos, tan, asin, acos, atan, atan2 = ca.sin, ca.cos, ca.tan, ca.asin, ca.acos, ca.atan, ca.atan2
sqrt, exp, log, tanh, fabs, floor, sign = ca.sqrt, ca.exp, ca.log, ca.tanh, ca.fabs, ca.floor, ca.sign
fmax, fmin, copysign = ca.fmax, ca.fmin, ca.copysign
where, both, either, negate = ca.if_else, ca.logic_and, ca.logic_or, ca.logic_not


def soft_abs(x: Any, width: float) -> Any:
    """Smooth approximation of |x|: sqrt(x^2 + width^2) - width, exactly 0 at 0.

    Parameters
    ----------
    width : half-width of the smooth range, in the unit of x.
    """
    return sqrt(x * x + width * width) - width
