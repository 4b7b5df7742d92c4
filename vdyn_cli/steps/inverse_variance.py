"""The mean of several measurements of one quantity, weighted by inverse variance."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, Contribution


def weighted_mean(budgets: Mapping[str, Budget], unit: str) -> Budget:
    """The mean weighted by inverse variance; each measurement is a contribution whose slope is its weight.

    x = sum w_i x_i, w_i = u_i^-2 / sum u_j^-2. Assumes independent measurements with standard deviations above 0.

    Parameters
    ----------
    budgets : of the measurements, by name. unit : of the quantity.
    """
    weight = np.array([budget.std**-2.0 for budget in budgets.values()])
    weight = weight / weight.sum()
    value = float(weight @ np.array([budget.value for budget in budgets.values()]))
    parts = tuple(
        Contribution(name, b.value, b.std, unit, float(w), b.degrees)
        for (name, b), w in zip(budgets.items(), weight, strict=True)
    )
    return Budget(value, parts)
