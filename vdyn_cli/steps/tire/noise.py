"""Noise in both slip and force: each bin is compared with the nearest point of the curve (effective variance)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.tire.binned_sweep import BinnedSweep

SHIFT = 1e-4  # slip, for the curvature of the curve by central differences
PROJECTIONS = 5  # Newton steps onto the curve; each squares the remaining error


@dataclass(frozen=True)
class CurvePoints:
    """The points of the curve nearest to the bins of one sweep, relative to the noise of slip and force.

    Parameters
    ----------
    slip, force, slope : (n,) of the curve at these points; force in N, slope in N per unit of slip.
    mean : (n,) N, bias of the residual by the noise of the slip and its drift inside the bin.
    deviation : (n,) N, standard deviation of the residual.
    """

    slip: Array
    force: Array
    slope: Array
    mean: Array
    deviation: Array

    def residual(self, sweep: BinnedSweep) -> Array:
        """Fitted minus measured force (n,), N, at the measured slips, to first order about the points."""
        return np.asarray(self.force + self.slope * (sweep.slip - self.slip) - sweep.force)


def nearest_points(sweep: BinnedSweep, curve: Callable[[Array], tuple[Array, Array]]) -> CurvePoints:
    """Project the slips of one sweep onto the curve.

    A bin's true slip is unknown. The projection x onto the curve (orthogonal distance, to first order in the slip's
    error) gives the residual R = F - f(x) - f'(x) (s - x) with variance vF + f'^2 vs, uncorrelated with x. To second
    order R has the mean f''/2 (S - V): S is the variance of the true slip in the bin, V = vs vF / (vF + f'^2 vs) that
    of x.

    Parameters
    ----------
    curve : slips (n,) -> force (n,), N, and its slope (n,), N per unit of slip.

    Source: effective variance after Orear, Am. J. Phys. 50 (1982) 912; the second-order mean is derived here.
    """
    slip = sweep.slip
    for _ in range(PROJECTIONS):
        force, slope = curve(slip)
        noise = sweep.force_variance + (force / sweep.load) ** 2 * sweep.load_variance
        total = noise + slope**2 * sweep.slip_variance
        slip = sweep.slip + slope * sweep.slip_variance / total * (sweep.force - force - slope * (sweep.slip - slip))
    curvature = (curve(slip + SHIFT)[1] - curve(slip - SHIFT)[1]) / (2 * SHIFT)
    mean = curvature / 2 * (sweep.spread - sweep.slip_variance * noise / total)
    return CurvePoints(slip, force, slope, mean, np.sqrt(total))
