"""Derivatives of noisy channels from polynomials fitted to neighboring samples."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

# s to either side for the derivatives of loads and acceleration, of measured channels and of true channels. The latter
# is longer, because the noise of a derivative by an unknown makes the unknown's standard deviation too small.
SPAN, TRUE_SPAN = 0.06, 0.12


def derivative_reach(step: float, span: float) -> int:
    """Number of samples to either side of a derivative over ``span`` s; ``step`` s apart."""
    return max(round(span / step), 3)


def local_derivative(values: Array, step: float, span: float, order: int = 2) -> Array:
    """First or second derivative (n,) of a quintic fitted over ``span`` s to either side.

    0.06 s is accurate to some 5 Hz.

    Parameters
    ----------
    values : (n,). step : s, between samples. order : 1 or 2.
    """
    half = derivative_reach(step, span)
    width = 2 * half + 1
    if values.size < width:
        return np.zeros_like(values)
    x = np.linspace(-1.0, 1.0, width)
    quintic = np.linalg.pinv(np.vander(x, 6, increasing=True))  # coefficients of a window's values
    per_step = float(half * step) ** -order
    inner = np.correlate(values, order * per_step * quintic[order], "valid")
    ends = np.polynomial.polynomial.polyvander(x, 5 - order) @ np.polynomial.polynomial.polyder(quintic, order)
    ends = ends * per_step
    first, last = ends[:half] @ values[:width], ends[half + 1 :] @ values[-width:]
    return np.asarray(np.concatenate([first, inner, last]))
