"""Figures of a load-transfer test: front load and residual of the balance over acceleration."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.cg.load_fit import LoadFit


@dataclass(frozen=True)
class BalancedRun:
    """One run's window means at the solution, (k,) each.

    Parameters
    ----------
    load : front axle load, N. acceleration : m/s^2. time : middle of each window, s.
    imbalance : residual of the balance as front axle load, N. deviation : its standard deviation by the noise, N.
    """

    run: str
    time: Array
    load: Array
    acceleration: Array
    imbalance: Array
    deviation: Array


def balanced_runs(fit: LoadFit, solution: Solution) -> list[BalancedRun]:
    """Each run's window means at the solution."""
    found = []
    for run, windows in enumerate(fit.runs):
        load, acceleration = (
            windows.integral(windows.channels[n]) / windows.width for n in ("front_load", "acceleration")
        )
        found.append(BalancedRun(windows.run, windows.middle, load, acceleration, *fit.mean_imbalance(solution, run)))
    return found


def comparisons(runs: Sequence[BalancedRun]) -> tuple[Comparison, ...]:
    """Measured front loads against those that fulfill the balance, over time."""
    return tuple(Comparison(r.run, "front_load", "N", r.time, "time in s", r.load, r.load - r.imbalance) for r in runs)


def figures(runs: Sequence[BalancedRun]) -> tuple[Figure, ...]:
    """Load and imbalance over acceleration."""
    acceleration, imbalance = (
        np.concatenate([getattr(r, name) for r in runs]) for name in ("acceleration", "imbalance")
    )
    return (
        Figure(
            "transfer",
            "Load transfer",
            "Front axle load over acceleration. Good: a narrow band with one slope; its width is the pitching of the "
            "body. Bad: two parallel bands (a load cell's zero, or a road grade that changes sign with the "
            "direction), or a bend.",
            "acceleration in m/s²",
            "front axle load in N",
            tuple(Series(r.run, r.acceleration, r.load, "points") for r in runs),
        ),
        Figure(
            "imbalance",
            "Imbalance over acceleration",
            "Residual of the moment balance, as front axle load. Good: no slope and no shape. Bad: a slope (force "
            "gain, height), a fan at both ends (clock offset between loads and acceleration).",
            "acceleration in m/s²",
            "N",
            (Series("imbalance", acceleration, imbalance, "points", role="residual"),),
        ),
    )
