"""Correlation of a road's slope over distance."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array

# Correlations of the slope as sums of (share, length in m, smooth). Road elevation has a power density of about 1/n^2
# (ISO 8608), slope a flat one: the third is flat for waves of 100 m to 2 km. Built roads are smooth: vertical curves
# are parabolas of 100 m to 1 km (the others, Matern 3/2 with 5 % of rough road). Ordered by the longest waves.
SPECTRA: tuple[tuple[tuple[float, float, bool], ...], ...] = (
    ((0.95, 50.0, True), (0.05, 50.0, False)),
    ((0.95, 120.0, True), (0.05, 50.0, False)),
    ((0.5, 50.0, False), (0.5, 300.0, False)),
    ((0.95, 300.0, True), (0.05, 50.0, False)),
)


def slope_correlation(knots: Array, spectrum: int) -> Array:
    """Correlation (m, m) of slopes at knots.

    sum of share (1 + a) exp(-a), a = sqrt(3) d / length (Matern 3/2), where smooth, else share exp(-d / length), d the
    distance of two knots, m

    Parameters
    ----------
    knots : (m,) m. spectrum : index in SPECTRA.
    """
    return correlation_at(np.abs(knots[:, None] - knots[None, :]), spectrum)


def correlation_at(apart: Array, spectrum: int) -> Array:
    """Correlation of the slopes at two places, of the shape of their distances ``apart``, m."""
    correlation = np.zeros_like(apart)
    for share, length, smooth in SPECTRA[spectrum]:
        far = np.sqrt(3.0) * apart / length
        correlation += share * ((1.0 + far) * np.exp(-far) if smooth else np.exp(-apart / length))
    return correlation
