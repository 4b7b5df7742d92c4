"""Comparison of the fitted curve's slope at zero slip with that of the measured friction."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.quantities.parameters import Estimate, normal_interval
from vdyn_cli.steps.tire.binned_sweep import BinnedSweep
from vdyn_cli.steps.tire.noise import CurvePoints

STEEP = 0.6  # share of the largest friction below which three terms describe its rise with slip
FEWEST_BINS = 12  # bins there: three for each of the four coefficients
CLEARLY = 3.0  # standard deviations of the local slope: a correct curve exceeds them in 3 of 1000 tests


def agreeing_with_data(
    slope: Estimate, sweeps: Sequence[BinnedSweep], points: Sequence[CurvePoints]
) -> tuple[Estimate, tuple[str, ...]]:
    """The slope at zero slip, with an interval that includes the slope of the measured friction where they differ.

    The residual friction at small slips x is fitted by d0 + d1 x + d2 x |x| + d3 x^3; the measured slope exceeds the
    curve's by d1; they differ where |d1| is at least ``CLEARLY`` standard deviations. A curve of the wrong form can fit
    a sweep closely up to the peak and have a wrong initial slope.

    Parameters
    ----------
    slope : of friction over slip at zero slip, by the fitted curve. sweeps : averaged into bins.
    points : points of the fitted curve nearest to the bins of each sweep.

    Returns
    -------
    The estimate, and a warning where the slopes differ.
    """
    slip, load = (np.concatenate(each) for each in ([p.slip for p in points], [s.load for s in sweeps]))
    friction, noise = (
        np.concatenate(each) / load for each in ([p.force for p in points], [p.deviation for p in points])
    )
    left = -np.concatenate([p.residual(s) for p, s in zip(points, sweeps, strict=True)]) / load
    near = np.abs(friction) < STEEP * np.abs(friction).max()
    if np.count_nonzero(near) < FEWEST_BINS:
        return slope, ()
    x = slip[near]
    columns = np.column_stack([x, x * np.abs(x), x**3, np.ones(x.size)]) / noise[near, None]
    found, _, rank, _ = np.linalg.lstsq(columns, left[near] / noise[near])
    if rank < columns.shape[1]:
        return slope, ()
    misfit = float(np.mean((left[near] / noise[near] - columns @ found) ** 2))
    std = float(np.sqrt(np.linalg.inv(columns.T @ columns)[0, 0] * max(misfit, 1.0)))
    excess = float(found[0])
    if abs(excess) < CLEARLY * std:
        return slope, ()
    local = slope.value + excess
    (low, high), (below, above) = slope.interval95, normal_interval(local, std)
    held = min(low, below), max(high, above)
    warning = (
        f"the measured friction rises by {local:.4g} +- {NORMAL95 * std:.2g} per unit of slip at zero slip, the fitted "
        f"curve by {slope.value:.4g}: the magic formula does not fit this tire; the interval includes both"
    )
    return replace(slope, interval95=held, std=max(slope.std, (held[1] - held[0]) / (2 * NORMAL95))), (warning,)
