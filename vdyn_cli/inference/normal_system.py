"""The normal system at a minimum: covariances of shared and own unknowns, variance and degrees of freedom."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from vdyn_cli.inference.minimize import Minimum
from vdyn_cli.inference.qr_factors import Reduced
from vdyn_cli.inference.regression import Regression
from vdyn_cli.quantities.arrays import Array


class Solved:
    """The reduced normal system at a minimum, its covariances computed on demand."""

    def __init__(self, regression: Regression, minimum: Minimum) -> None:
        self.regression, self.minimum = regression, minimum
        self.point = minimum.point
        self.s, self.m = len(regression.shared), len(regression.own)
        self.reduced: Reduced = self.point.system.reduced()

    @cached_property
    def covariance(self) -> Array:
        """Inverse information about the shared unknowns, (s, s)."""
        inverse = np.linalg.inv(self.reduced.factor[: self.s, : self.s]) if self.s else np.zeros((0, 0))
        return inverse @ inverse.T

    @cached_property
    def own(self) -> Array:
        """Covariance of each run's own unknowns for known shared ones, (g, m, m)."""
        inverse = np.linalg.inv(self.reduced.own[:, :, : self.m])
        return np.asarray(inverse @ inverse.transpose(0, 2, 1))

    @cached_property
    def own_response(self) -> Array:
        """Derivative of the optimum of each run's own unknowns with respect to the shared ones, (g, m, s)."""
        return np.asarray(-np.linalg.solve(self.reduced.own[:, :, : self.m], self.reduced.own[:, :, self.m : -1]))

    @property
    def variance(self) -> float:
        """Variance of one whitened row: 1 where the noise model holds."""
        return self.point.squares / self.degrees

    @property
    def degrees(self) -> float:
        """Degrees of freedom: rows, priors included, minus unknowns."""
        return float(max(self.point.n_rows - len(self.point.x), 1))

    def own_covariance(self, run: int) -> Array:
        """Inverse information about one run's own unknowns, (m, m)."""
        return np.asarray(self.own[run] + self.own_response[run] @ self.covariance @ self.own_response[run].T)
