"""Levenberg and Marquardt's iteration within bounds, on the QR factors of a regression over runs."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.qr_factors import reduce
from vdyn_cli.inference.regression import Objective, Point
from vdyn_cli.quantities.arrays import Array

NEGLIGIBLE = 1e-16  # predicted reduction, relative to the cost, below which the fit has converged
HARMLESS = 1e-4  # predicted reduction, in variances of one residual, below which a stalled fit has converged
NONDIFFERENTIABLE = 2.0  # likewise (two standard errors), if no step achieves the reduction predicted at a kink
PLATEAU = 1e-3  # share of an unknown's sensitivity left after one step, below which the step is rejected
PREDICTED = 0.75  # share of the predicted reduction of the cost from which the linearization predicts well
SUFFICIENT = 1e-4  # share of the predicted reduction of the cost that a step must achieve
IDLE = 3  # consecutive steps that gained less than the tolerance: the next failed step ends the fit
PARTS = (1.0, 0.3, 0.1, 0.03)  # of a full step, tried at a kink
HOPELESS = 4  # consecutive points that predict no cost below the one reached by another fit
# Iterations over which the pace of a fit is measured: more than a fit takes to turn into a narrow valley. Fits of dry
# friction crept for 200 iterations, because their linearization predicts much more than a step gains.
PACE = 12
LEAST_DAMPING = 1e-13
MOST_DAMPING = 1e12


@dataclass(frozen=True)
class Minimum:
    """End of the iteration.

    Parameters
    ----------
    converged : whether it is a minimum.
    step : the undamped step at the end.
    """

    point: Point
    converged: bool
    step: Array
    iterations: int


def minimize(
    evaluate: Objective,
    start: Array,
    lower: Array,
    upper: Array,
    most_iterations: int,
    tolerance: float = 0.0,
) -> Minimum:
    """Least squares within bounds from one start.

    Each step d solves min |J d + r|^2 + mu |D d|^2 over the unknowns that are not at a bound, D the largest column
    norms so far; an unknown that would leave its range stops at the bound. mu falls where the linearization predicts
    well and rises where it does not; after a step where it does not, a point is linearized only if its cost falls. The
    iteration ends early where it does not predict, or is too slow to reach, the cost of another fit
    (``Regression.reached``). Source: after More, Numerical Analysis, Lecture Notes in Mathematics 630 (1978) 105.

    Parameters
    ----------
    evaluate : cost and QR factors at x, or None where the model cannot be computed.
    start, lower, upper : (s + g m), start values and bounds; the start is clipped to the bounds.
    most_iterations : largest number of iterations.
    tolerance : convergence: largest reduction of the sum of squares that the linearization predicts for a full step, in
        variances of one residual; a hundred times that where the fit stalls. At a nondifferentiable point, and with a
        large residual, no step achieves the prediction: if it is below two standard errors, the actual reductions of
        the step and of parts of it are tested instead.

    Raises
    ------
    ArithmeticError
        The model cannot be computed at the start.
    """
    point = evaluate(np.clip(start, lower, upper))
    if point is None:
        raise ArithmeticError("the model has no finite value at the start")
    scale = _positive(point.system.column_norms())
    damping, growth = 1e-3, 2.0
    idle, hopeless, gain = 0, 0, 0.0
    costs = [point.cost]
    for iteration in range(most_iterations):
        active = _active(point, lower, upper)
        full = _step(point, active, scale, LEAST_DAMPING)
        promise = point.system.reduction(full)
        variance = point.cost / max(point.n_rows - len(point.x), 1)  # half of it, like the cost
        if promise <= max(NEGLIGIBLE * point.cost, tolerance * variance):
            return Minimum(point, True, full, iteration)
        hopeless = hopeless + 1 if point.cost - promise > evaluate.regression.reached - tolerance * variance else 0
        if hopeless == HOPELESS or _too_slow(costs, evaluate.regression.reached, most_iterations - iteration):
            return Minimum(point, False, full, iteration)
        while True:
            step = _step_within(point, active, scale, damping, lower, upper)
            x, predicted = _snapped(point.x + step, lower, upper), point.system.reduction(step)
            trial = _falling(evaluate, x, point.cost - SUFFICIENT * predicted, likely=gain > PREDICTED)
            gain = (point.cost - trial.cost) / predicted if trial is not None and predicted > 0 else -1.0
            if trial is not None and gain > SUFFICIENT and not _on_plateau(point, trial):
                break
            damping, growth = damping * growth, growth * 2
            if damping > MOST_DAMPING or idle > IDLE or not np.any(point.x + step != point.x):
                harmless = max(HARMLESS, 100 * tolerance) * variance
                arrived = promise <= harmless or (
                    promise <= NONDIFFERENTIABLE * variance
                    and _largest_reduction(evaluate, point, full, lower, upper) <= harmless
                )
                return Minimum(point, arrived, full, iteration)
        damping = max(damping * (0.3 if gain > PREDICTED else 1.0 if gain > 0.25 else 2.0), LEAST_DAMPING)
        growth = 2.0
        idle = idle + 1 if point.cost - trial.cost < tolerance * variance else 0
        point = trial
        costs.append(point.cost)
        scale = np.maximum(scale, point.system.column_norms())
    return Minimum(point, False, full, most_iterations)


def _too_slow(costs: Sequence[float], reached: float, left: int) -> bool:
    """Whether a fit at its recent pace does not fall to the cost reached by another fit in the iterations left."""
    if len(costs) <= PACE or costs[-1] <= reached:
        return False
    return costs[-1] - left * (costs[-1 - PACE] - costs[-1]) / PACE > reached


def _falling(evaluate: Objective, x: Array, below: float, likely: bool) -> Point | None:
    """The linearization at x; None where the cost alone, if it is cheaper, is not below a limit.

    Where that is ``likely``, as after a step that gained what was predicted, the cost alone would only be repeated.
    """
    return evaluate(x) if likely or not evaluate.cheap or evaluate.cost(x) < below else None


def _largest_reduction(evaluate: Objective, point: Point, step: Array, lower: Array, upper: Array) -> float:
    """Largest reduction of the cost by a step or by a part of it."""
    return max(point.cost - evaluate.cost(np.clip(point.x + part * step, lower, upper)) for part in PARTS)


def _snapped(x: Array, lower: Array, upper: Array) -> Array:
    """x, with values that rounding left next to a bound set to the bound."""
    x = np.where(np.isclose(x, lower, rtol=1e-14, atol=0), lower, x)
    return np.where(np.isclose(x, upper, rtol=1e-14, atol=0), upper, x)


def _positive(norms: Array) -> Array:
    return np.where(norms > 0, norms, 1.0)


def _on_plateau(point: Point, trial: Point) -> bool:
    """Whether a step moved an unknown to a plateau, where the model is almost independent of it."""
    return bool(np.any(trial.system.column_norms() < PLATEAU * point.system.column_norms()))


def _active(point: Point, lower: Array, upper: Array) -> NDArray[np.bool_]:
    gradient = point.system.gradient()
    return np.asarray(((point.x <= lower) & (gradient >= 0)) | ((point.x >= upper) & (gradient <= 0)))


def _step(point: Point, active: NDArray[np.bool_], scale: Array, damping: float) -> Array:
    """The damped step of the unknowns that no bound holds."""
    return _completed(point, np.zeros_like(point.x), active, scale, damping)


def _step_within(
    point: Point, active: NDArray[np.bool_], scale: Array, damping: float, lower: Array, upper: Array
) -> Array:
    """The damped step within the bounds: unknowns that would leave stop at their bound, the others are solved again."""
    held, step = active.copy(), np.zeros_like(point.x)
    while True:
        step = _completed(point, step, held, scale, damping)
        inside = np.clip(point.x + step, lower, upper) - point.x
        leaving = ~held & (inside != step) & ((point.x + step < lower) | (point.x + step > upper))
        if not leaving.any():
            return np.asarray(inside)
        step, held = inside, held | leaving


def _completed(point: Point, step: Array, held: NDArray[np.bool_], scale: Array, damping: float) -> Array:
    """The complete step: the held unknowns' part is given, the others are solved for by damped least squares."""
    system = point.system.after(step, held)
    s = system.n_shared
    reduced = reduce(system, scale * np.where(held, 1.0, np.sqrt(damping)))
    columns = reduced.factor[:, :s] / scale[:s]
    shared: Array = np.linalg.lstsq(columns, -reduced.factor[:, s], rcond=1e-15)[0] / scale[:s]
    return np.where(held, step, np.concatenate([shared, reduced.own_step(shared).ravel()]))
