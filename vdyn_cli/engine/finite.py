"""Errors of a simulation that is not finite: when, which state, and the remedy."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError


def first_not_finite(rows: Array) -> int | None:
    """Index of the first row of (n, k) with a value that is not finite; None if there is none."""
    odd = ~np.isfinite(rows).all(axis=1)
    return int(np.argmax(odd)) if odd.any() else None


def diverged_first(rows: Array, row: int, names: Sequence[str]) -> str:
    """Name of the column that diverged first: of those not finite at ``row``, that with the largest growth before it.

    In an unstable integration all states diverge within a step or two; the cause is the state that oscillates with
    growing amplitude.

    Parameters
    ----------
    rows : (n, k). row : the first row that is not finite. names : of the columns, for the message.
    """
    odd = np.flatnonzero(~np.isfinite(rows[row]))
    odd = odd[odd < len(names)]
    if not odd.size:
        return "the simulation"
    last = odd[0]
    if row >= 2:
        with np.errstate(over="ignore", invalid="ignore"):
            moved = np.abs(np.diff(rows[:row, odd], axis=0))
            usual = np.median(moved, axis=0) + 1e-9 * (np.abs(rows[0, odd]) + 1e-3)
            last = odd[int(np.argmax(np.nan_to_num(moved[-1] / usual, posinf=np.finfo(float).max)))]
    return names[last] if odd.size == 1 else f"{names[last]}, and {odd.size - 1} more,"


def not_finite(model: str, time: float, step: float, what: str) -> ResultError:
    """The error of a simulation that is no longer finite.

    Parameters
    ----------
    model : its name. time : s, when. step : s, length of the integration steps. what : the quantity not finite.
    """
    return ResultError(
        Finding(
            f"model {model!r} at t = {time:.6g} s",
            f"{what} is not a finite number: the step of {1e3 * step:.3g} ms is too large, or the model is unstable",
            remedy="check the parameters and inputs at that time",
        )
    )
