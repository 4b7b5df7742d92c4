"""Figures of a load-transfer test: front load and residual of the balance over acceleration."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.cg.load_fit import LoadFit


def comparisons(fit: LoadFit, imbalances: Sequence[Array]) -> tuple[Comparison, ...]:
    """Measured front loads against those that fulfill the balance, over time.

    Parameters
    ----------
    imbalances : for each run, residual of the balance in each window as front axle load (k,), N.
    """
    loads = [windows.mean("front_load") for windows in fit.runs]
    return tuple(
        Comparison(w.run, "front_load", "N", w.middle, "time in s", load, load - imbalance)
        for w, load, imbalance in zip(fit.runs, loads, imbalances, strict=True)
    )


def figures(fit: LoadFit, compared: Sequence[Comparison]) -> tuple[Figure, ...]:
    """Load and imbalance over acceleration."""
    accelerations = [windows.mean("acceleration") for windows in fit.runs]
    imbalance = np.concatenate([c.measured - c.simulated for c in compared])
    return (
        Figure(
            "transfer",
            "Load transfer",
            "Front axle load over acceleration. Good: a narrow band with one slope; its width is the pitching of the "
            "body. Bad: two parallel bands (a load cell's zero, or a road grade that changes sign with the "
            "direction), or a bend.",
            "acceleration in m/s²",
            "front axle load in N",
            tuple(Series(c.run, a, c.measured, "points") for c, a in zip(compared, accelerations, strict=True)),
        ),
        Figure(
            "imbalance",
            "Imbalance over acceleration",
            "Residual of the moment balance, as front axle load. Good: no slope and no shape. Bad: a slope (force "
            "gain, height), a fan at both ends (clock offset between loads and acceleration).",
            "acceleration in m/s²",
            "N",
            (Series("imbalance", np.concatenate(accelerations), imbalance, "points", role="residual"),),
        ),
    )
