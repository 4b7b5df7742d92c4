"""The solution of a fit: estimates, covariance, intervals, and the independent units behind them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.regression import Unknown
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class Unit:
    """One independent unit at the solution.

    Parameters
    ----------
    run, block : index of the run, label of the block within it; where the run is the unit, of its first part, and 0.
    factor : (h, k + 1), QR factor of its rows [own | shared | residual], of each part, without priors.
    change : (s,), change of the shared unknowns when the unit is left out.
    """

    run: int
    block: int
    factor: Array
    change: Array


@dataclass(frozen=True)
class Solution:
    """Estimates of a fit with their uncertainty.

    Parameters
    ----------
    names : the shared unknowns, in the order of every matrix here.
    values, std, interval95 : of the shared unknowns; from the scatter between units unless ``unit`` is "model".
    per_run, per_run_std : (runs,) of each per-run unknown; these standard deviations come from the noise model.
    covariance : (s, s), of the values.
    classical_covariance : (s, s), for independent rows: sum of squares / (rows - unknowns) x inverse information.
    cost : half the sum of squares, priors included.
    residuals : per run, at the solution.
    unit, n_units, effective_units : the independent unit, the number of units, and the smallest effective number of
        units over the unknowns.
    degrees : of Student's t, for each shared unknown.
    """

    names: tuple[str, ...]
    values: Mapping[str, float]
    std: Mapping[str, float]
    interval95: Mapping[str, tuple[float, float]]
    per_run: Mapping[str, Array]
    per_run_std: Mapping[str, Array]
    covariance: Array
    classical_covariance: Array
    cost: float
    residuals: tuple[Array, ...]
    unit: Literal["run", "block", "model"]
    n_units: int
    effective_units: float
    degrees: Mapping[str, float]
    units: tuple[Unit, ...]
    warnings: tuple[str, ...]

    @property
    def correlation(self) -> dict[str, dict[str, float]]:
        """Correlation of the shared unknowns, by name."""
        size = np.sqrt(np.diag(self.covariance))
        matrix = self.covariance / np.where(size > 0, np.outer(size, size), 1.0)
        return {a: {b: float(matrix[i, j]) for j, b in enumerate(self.names)} for i, a in enumerate(self.names)}

    def local(self, unknowns: Sequence[Unknown], run: int) -> Array:
        """The values (k,) of shared and per-run unknowns in one run."""
        return np.array([self.per_run[u.name][run] if u.per_run else self.values[u.name] for u in unknowns])

    def half_width(self, name: str) -> float:
        """Half the 95 % interval of a shared unknown."""
        low, high = self.interval95[name]
        return 0.5 * (high - low)

    def move_from(self, before: Mapping[str, float]) -> float:
        """Largest change of these values by the fit, in standard deviations; infinite where one with none changes."""
        return max((_ratio(abs(self.values[n] - at), self.std[n]) for n, at in before.items()), default=0.0)

    @property
    def classical_std(self) -> dict[str, float]:
        """Standard errors under the assumption that all rows are independent."""
        return dict(zip(self.names, np.sqrt(np.diag(self.classical_covariance)).tolist(), strict=True))

    def std_of(self, gradient: Mapping[str, float] | Array) -> float:
        """Standard deviation, to first order, of a function of the shared unknowns with this gradient."""
        g = self._gradient(gradient)
        return float(np.sqrt(max(float(g @ self.covariance @ g), 0.0)))

    def interval_of(self, value: float, gradient: Mapping[str, float] | Array) -> tuple[float, float]:
        """95 % interval, to first order, of a function of the shared unknowns with this value and gradient."""
        parts = np.abs(self._gradient(gradient)) * np.sqrt(np.diag(self.covariance))
        degrees = [self.degrees[n] for n, p in zip(self.names, parts, strict=True) if p > 1e-3 * parts.max()]
        half = t_quantile(min(degrees)) * self.std_of(gradient) if degrees else 0.0
        return value - half, value + half

    def including(self, shift: Mapping[str, float]) -> Solution:
        """The solution with 95 % intervals that also include the values moved by a shift of some shared unknowns.

        C + d d' / t^2, d the shift (s,) and t the 97.5 % quantile of Student's t
        """
        quantile = {n: t_quantile(self.degrees[n]) for n in self.names}
        scaled = np.array([shift.get(n, 0.0) / quantile[n] for n in self.names])
        covariance = self.covariance + np.outer(scaled, scaled)
        std = dict(zip(self.names, np.sqrt(np.diag(covariance)).tolist(), strict=True))
        interval = {n: (self.values[n] - q * std[n], self.values[n] + q * std[n]) for n, q in quantile.items()}
        return replace(self, covariance=covariance, std=std, interval95=interval)

    def _gradient(self, gradient: Mapping[str, float] | Array) -> Array:
        if isinstance(gradient, Mapping):
            if unknown := sorted(set(gradient) - set(self.names)):
                raise KeyError(f"not among the shared unknowns: {', '.join(unknown)}")
            return np.array([float(gradient.get(n, 0.0)) for n in self.names])
        return np.asarray(gradient, dtype=float)


def _ratio(move: float, std: float) -> float:
    return move / std if std > 0.0 else np.inf if move > 0.0 else 0.0
