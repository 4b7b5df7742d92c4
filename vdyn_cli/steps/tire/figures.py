"""Figures of a tire test: friction over slip, and the residual of the curve."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.tire.binned_sweep import BinnedSweep
from vdyn_cli.steps.tire.fitted_curve import FittedCurve


def comparisons(sweeps: Sequence[BinnedSweep], residuals: Sequence[Array]) -> tuple[Comparison, ...]:
    """Measured and fitted force of each sweep's bins; ``residuals`` are fitted minus measured, (bins,) N each."""
    return tuple(
        Comparison(sweep.run, "force_x", "N", sweep.time, "time in s", sweep.force, sweep.force + residual)
        for sweep, residual in zip(sweeps, residuals, strict=True)
    )


def friction_over_slip(curve: FittedCurve, peak: float | None) -> Figure:
    """Figure of the bins of all sweeps and the curve at their mean load; ``peak`` is the slip of its peak."""
    fit, values = curve.fit, curve.solution.values
    slip = np.concatenate([sweep.slip for sweep in fit.sweeps])
    friction = np.concatenate([sweep.force / sweep.load for sweep in fit.sweeps])
    load = float(np.mean(np.concatenate([sweep.load for sweep in fit.sweeps])))
    grid = np.linspace(slip.min(), slip.max(), 300)
    series = [
        Series("measured, averaged", slip, friction, "points"),
        Series("curve", grid, fit.force(grid, load, values) / load, role="simulated"),
    ]
    if peak is not None:
        at = np.array([peak])
        series.append(Series("peak", at, fit.force(at, load, values) / load, "points", role="accent"))
    caption = (
        "Friction over slip. Good: the points scatter evenly about the line on both sides of zero and beyond the peak. "
        "Bad: a cloud that does not pass through the origin (wheel radius or force zero), one branch above the other "
        "(load or speed changes the friction), or points that end before the peak."
    )
    return Figure("curve", "Friction over slip", caption, "slip", "Fx / Fz", tuple(series))


def residual_over_slip(sweeps: Sequence[BinnedSweep], residuals: Sequence[Array]) -> Figure:
    """Figure of measured minus fitted friction over slip; ``residuals`` are fitted minus measured, (bins,) N each."""
    series = tuple(
        Series(sweep.run, sweep.slip, -residual / sweep.load, "points", role="residual")
        for sweep, residual in zip(sweeps, residuals, strict=True)
    )
    caption = (
        "Residual of the curve, in units of friction. Good: no shape. Bad: a wave near the knee (wrong form of the "
        "curve), a slope through zero (slip zero), or sweeps one above the other (load sensitivity)."
    )
    return Figure("residual", "Measured minus curve, over slip", caption, "slip", "friction", series)
