"""The law of a part as a curve with its 95 % band, and how closely laws of the catalog follow it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.diagnosis.part.part_search import FittedParts
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model_builder import MissingSignalError, Signals
from vdyn_cli.inference import Solution
from vdyn_cli.inference.function_prior import truncation_error
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array, spans
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.steps.free_part import Part

POINTS = 61  # of a curve: three for each of its twenty cosines
FEWEST_POINTS = 5  # of a curve that is shown
OUTERMOST = 10  # samples left out at each end of the coordinate, where single moments determine the curve
STEADY, INTEGRATION_STEP = 3.0, 1e-3  # s: duration and step to integrate an effect's states to their steady values


@dataclass(frozen=True)
class Curve:
    """One part's law over the range of its coordinate that the data cover.

    Parameters
    ----------
    at : (n,) coordinate. value : (n,) the whole law, or a sensor's error. half : (n,) half of the 95 % interval.
    baseline : (n,) the law of the baseline's fit. covariance : (n, n) of the value.
    """

    part: Part
    at: Array
    value: Array
    half: Array
    baseline: Array
    covariance: Array

    def gauge(self, values: Mapping[str, float]) -> Array:
        """The curves (n, k) that the baseline's unknowns can produce, and a constant if the law is not anchored."""
        columns = self.part.slopes(self.at, values)
        return columns if self.part.anchored else np.column_stack([columns, np.ones(len(self.at))])

    @property
    def weights(self) -> Array:
        """Share of the covered range that each point stands for, (n,)."""
        return np.asarray(np.gradient(self.at) / max(float(self.at[-1] - self.at[0]), 1e-300))

    def unabsorbed(self, curve: Array, values: Mapping[str, float]) -> Array:
        """The part (n,) of a curve that the unknowns of the baseline's law cannot follow, by weighted least squares.

        Parameters
        ----------
        curve : (n,). values : of the unknowns about which the law is linearized.
        """
        columns = self.gauge(values)
        root = np.sqrt(self.weights)[:, None]
        step = np.linalg.lstsq(root * columns, root[:, 0] * curve, rcond=None)[0]
        return np.asarray(curve - columns @ step)


def curve_of(part: Part, fitted: FittedParts, base: Solution, samples: Array | None) -> Curve | None:
    """The curve of one of the fitted parts; None where the data cover fewer than ``FEWEST_POINTS`` points.

    The 95 % band, half-width h, at a point x of the coordinate with the gradient g of the curve by the unknowns::

        h^2 = 1.96^2 (g' C g + truncation error)

    C is the covariance by the scatter between units or by the noise model with the smoothness prior, whichever gives
    the wider band. A point is covered if samples are near and h is at most ``covered_share`` of the prior's band.

    Parameters
    ----------
    part : the element whose law is free, one of ``fitted.parts``; its coordinate and curve are in SI.
    fitted : the fit with the part free. base : the fit without.
    samples : (n,) of the coordinate in the runs; None: everywhere.
    """
    solution = fitted.solution
    x = part.points(POINTS)
    own = [n for n in part.own if n in solution.values]
    names = [*own, *part.unknowns]
    basis = part.basis(x)
    covered = _within_data(x, samples) if samples is not None else np.ones(POINTS, dtype=np.bool_)
    if not part.own and not part.anchored:  # the fitted parameters absorb a constant: remove it from the curve
        basis = basis - basis[covered].mean(axis=0)
    gradient = np.column_stack([part.slopes(x, solution.values), basis]) if own else basis
    at = [solution.names.index(n) for n in names]
    half = np.max(
        [_half(gradient, solution, matrix, at) for matrix in (solution.covariance, solution.classical_covariance)],
        axis=0,
    )
    found = np.array([solution.values[n] for n in part.unknowns])
    half = np.hypot(half, NORMAL95 * np.sqrt(truncation_error(found, part.orders)))
    prior = np.sqrt(basis**2 @ fitted.variance_of(part))
    covered &= (half <= POLICY.covered_share * NORMAL95 * prior) | (np.abs(x) <= part.scale)
    covered = _longest(covered, x)
    if np.count_nonzero(covered) < FEWEST_POINTS:
        return None
    value = part.baseline(x, solution.values) + basis @ found
    inside = gradient[covered]
    covariance = inside @ solution.classical_covariance[np.ix_(at, at)] @ inside.T
    covariance += truncation_error(found, part.orders) * np.eye(len(inside))
    return Curve(part, x[covered], value[covered], half[covered], part.baseline(x[covered], base.values), covariance)


def _half(gradient: Array, solution: Solution, covariance: Array, at: Sequence[int]) -> Array:
    """Half-widths (points,) of the 95 % interval of linear functions of the unknowns at indices ``at``."""
    std = np.sqrt(np.maximum(np.einsum("pi,ij,pj->p", gradient, covariance[np.ix_(at, at)], gradient), 0.0))
    if covariance is solution.classical_covariance:
        return np.asarray(NORMAL95 * std)
    degrees = min(solution.degrees[solution.names[i]] for i in at)
    return np.asarray(t_quantile(max(degrees, POLICY.fewest_curve_degrees)) * std)


def _within_data(x: Array, samples: Array) -> NDArray[np.bool_]:
    """Whether each point (points,) lies within the samples of the coordinate, without the outermost ones."""
    known = np.sort(samples[np.isfinite(samples)])
    left_out = min(OUTERMOST, known.size // 20)
    return np.asarray((x >= known[left_out]) & (x <= known[-1 - left_out]))


def _longest(good: NDArray[np.bool_], x: Array) -> NDArray[np.bool_]:
    """The contiguous good points with the longest range of ``x``, (points,)."""
    first, stop = max(spans(good), key=lambda run: float(x[run[1] - 1] - x[run[0]]), default=(0, 0))
    chosen = np.zeros_like(good)
    chosen[first:stop] = True
    return chosen


def law_values(curve: Curve, effect: Effect, values: Mapping[str, float]) -> Array | None:
    """The element's law with an effect, (n,), at the curve's points; None where it depends on other signals.

    States of the effect have their steady values at each coordinate.
    """
    part = curve.part
    if part.law is None or part.element not in effect.laws:
        return None
    q = Signals(**{n: values.get(n, effect.nominal.get(n, 0.0)) for n in effect.unknowns})
    found = []
    try:
        for x in curve.at.tolist():
            s = part.signals(x, values)
            rest = s.but(**_at_rest(effect, s.but(**q.__dict__)))
            found.append(float(effect.laws[part.element](part.law, rest, q)))
    except (MissingSignalError, ZeroDivisionError, OverflowError):
        return None
    value = np.array(found)
    return value if np.all(np.isfinite(value)) else None


def _at_rest(effect: Effect, s: Signals) -> dict[str, float]:
    """The effect's states after a long time at constant signals."""
    states = dict.fromkeys(effect.states, 0.0)
    for _ in range(int(STEADY / INTEGRATION_STEP) if states else 0):
        there = s.but(**states)
        rates = {n: float(rate(there)) for n, rate in effect.states.items()}
        states = {n: v + INTEGRATION_STEP * rates[n] for n, v in states.items()}
        if all(abs(r) < 1e-6 for r in rates.values()):
            break
    return states


def share_of_curve(curves: Sequence[tuple[Curve, Array]], values: Mapping[str, float]) -> float:
    """Share of the curves' rms deviation from the baseline's law that laws explain, 0 to 1.

    1 - sqrt(sum w (curve - law)^2 / sum w deviation^2), both without what the baseline's unknowns can follow.

    Parameters
    ----------
    curves : each with the law's values at its points. values : of the unknowns, to linearize the baseline's law.
    """
    left = sum(float(c.weights @ c.unabsorbed(c.value - law, values) ** 2) for c, law in curves)
    whole = sum(float(c.weights @ c.unabsorbed(c.value, values) ** 2) for c, _ in curves)
    return 1.0 - float(np.sqrt(left / whole)) if whole > 0 and left < whole else 0.0
