"""Types of arrays: numbers, truth values, indices; integral, interpolation, change, robust deviation, rms, spans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]
Rows = NDArray[np.intp]  # indices of rows

NORMAL_FROM_MEDIAN = 1.482602218505602  # standard deviation of a normal variable per median absolute value


def cumulative_integral(x: Array, y: Array) -> Array:
    """Integral of y (n,) over x (n,) from the first point to each point, (n,), by the trapezoidal rule."""
    return np.concatenate([[0.0], np.cumsum(np.diff(x) * (y[1:] + y[:-1]) / 2.0)])


def filled(x: Array, y: Array) -> Array:
    """The values y (n,) at x (n,), linear over missing ones (NaN) and constant before and after all others; else 0."""
    there = np.isfinite(y)
    return np.asarray(np.interp(x, x[there], y[there])) if there.any() else np.zeros(x.size)


def net_change(values: Array) -> float:
    """Last minus first value (n,) that is not missing (NaN); 0 without any."""
    there = values[np.isfinite(values)]
    return float(there[-1] - there[0]) if there.size else 0.0


def median_deviation(residuals: Array) -> float:
    """Standard deviation of normal residuals (n,) about zero, 1.4826 median |x|, which few outliers do not change."""
    return NORMAL_FROM_MEDIAN * float(np.median(np.abs(residuals)))


def rms(*parts: Array | float) -> float:
    """Root mean square of all values of arrays (n,) or numbers that are not missing (NaN); NaN without any."""
    values = np.concatenate([np.ravel(p) for p in parts])
    known = values[~np.isnan(values)]
    return float(np.sqrt(np.mean(known**2))) if known.size else float("nan")


def spans(flags: Mask) -> list[tuple[int, int]]:
    """First index, and index after the last, of each segment of true flags (n,)."""
    edges = np.flatnonzero(np.diff(flags, prepend=False, append=False)).tolist()
    return list(zip(edges[::2], edges[1::2], strict=True))
