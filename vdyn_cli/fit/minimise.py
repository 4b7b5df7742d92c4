"""Levenberg and Marquardt's iteration within bounds, on the triangles of a regression over runs."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vdyn_cli.fit.regression import Point
from vdyn_cli.fit.triangles import Array, reduce

NEGLIGIBLE = 1e-16  # of the cost: a step that promises less has arrived
HARMLESS = 1e-4  # of one residual's variance: a stalled step that promises less moves nothing that matters
BLIND = 1e-3  # of an unknown's sensitivity left after one step
LEAST_DAMPING = 1e-13
MOST_DAMPING = 1e12


@dataclass(frozen=True)
class Minimum:
    """Where the iteration ended.

    Parameters
    ----------
    active : unknowns that the fit pushes against a bound.
    converged : whether it is a minimum.
    promise : reduction of the cost that a full step would still promise.
    step : that full step.
    """

    point: Point
    active: np.ndarray
    converged: bool
    promise: float
    step: Array
    iterations: int


def minimise(
    evaluate: Callable[[Array], Point | None],
    start: Array,
    lower: Array,
    upper: Array,
    most_iterations: int,
) -> Minimum:
    """Least squares within bounds from one start.

    Each step d solves min |J d + r|^2 + mu |D d|^2 over the unknowns that no bound holds, D the largest column norms
    met so far, and is cut at the bounds; mu falls where the linearisation predicts well and rises where it does not.

    Parameters
    ----------
    evaluate : cost and triangles at x, or None where the model cannot be computed.

    Raises
    ------
    ArithmeticError
        The model cannot be computed at the start.
    """
    point = evaluate(np.clip(start, lower, upper))
    if point is None:
        raise ArithmeticError("the model has no finite value at the start")
    scale = _positive(point.arrow.column_norms())
    damping, growth = 1e-3, 2.0
    for iteration in range(most_iterations):
        active = _active(point, lower, upper)
        full = _step(point, active, scale, LEAST_DAMPING, lower, upper)
        promise = point.arrow.reduction(full)
        if promise <= NEGLIGIBLE * point.cost:
            return Minimum(point, active, True, promise, full, iteration)
        while True:
            step = _step(point, active, scale, damping, lower, upper)
            trial = evaluate(point.x + step)
            predicted = point.arrow.reduction(step)
            gain = (point.cost - trial.cost) / predicted if trial is not None and predicted > 0 else -1.0
            if trial is not None and gain > 1e-4 and not _blinded(point, trial):
                break
            damping, growth = damping * growth, growth * 2
            if damping > MOST_DAMPING or not np.any(point.x + step != point.x):
                harmless = promise <= HARMLESS * point.cost / max(point.n_rows - len(point.x), 1)
                return Minimum(point, active, harmless, promise, full, iteration)
        damping = max(damping * (0.3 if gain > 0.75 else 1.0 if gain > 0.25 else 2.0), LEAST_DAMPING)
        growth = 2.0
        point = trial
        scale = np.maximum(scale, point.arrow.column_norms())
    return Minimum(point, _active(point, lower, upper), False, promise, full, most_iterations)


def _positive(norms: Array) -> Array:
    return np.where(norms > 0, norms, 1.0)


def _blinded(point: Point, trial: Point) -> bool:
    """Whether a step threw an unknown onto a plateau, where the model has all but forgotten it."""
    return bool(np.any(trial.arrow.column_norms() < BLIND * point.arrow.column_norms()))


def _active(point: Point, lower: Array, upper: Array) -> np.ndarray:
    gradient = point.arrow.gradient()
    return np.asarray(((point.x <= lower) & (gradient >= 0)) | ((point.x >= upper) & (gradient <= 0)))


def _step(point: Point, active: np.ndarray, scale: Array, damping: float, lower: Array, upper: Array) -> Array:
    """The damped step, cut at the bounds."""
    arrow = point.arrow.without(active)
    s = arrow.n_shared
    reduced = reduce(arrow, scale * np.where(active, 1.0, np.sqrt(damping)))
    columns = reduced.triangle[:, :s] / scale[:s]
    shared: Array = np.linalg.lstsq(columns, -reduced.triangle[:, s], rcond=1e-15)[0] / scale[:s]
    step = np.concatenate([shared, reduced.own_step(shared).ravel()])
    step[active] = 0.0
    return np.asarray(np.clip(point.x + step, lower, upper) - point.x)
