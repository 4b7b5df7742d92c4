"""The bias of the parameters by an unexplained residual.

The unexplained effect is modeled as a continuous free profile f = sum_k a_k hat_k: a random walk from the middle of its
coordinate, a = tau L e with e ~ N(0, I), of the same size in directions that the fitted parameters absorb and in
visible ones. The visible ones give tau: with V = S'S = sum_i l_i v_i v_i' the information about e of the profile's
sensitivities S orthogonal to the fitted ones, and u = S'y its score,

    u_i / l_i ~ N(0, tau^2 + 1 / l_i),     tau by maximum likelihood,

and the error of a parameter is tau B e, with B the bias by one unit of each e: half = t(r) tau |B|, r the number of
visible directions, of which refitting leaves ``least_visibility`` or more. The remainder of the others is an error of
the laws (straight lines between knots instead of a parabola) and gives no size. With independent coefficients instead
of a walk, the part that resembles a parameter (a level, a slope) would be too small. Source: empirical Bayes, Morris,
J. Am. Stat. Assoc. 78 (1983) 47.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

import numpy as np

from vdyn_cli.diagnosis.detect.scores import ROUNDING
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.full_model import FittedModel, FullModel
from vdyn_cli.diagnosis.strategies.linearized_system import Projection
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.qr_factors import least_squares
from vdyn_cli.quantities.arrays import Array

TRIED_PER_DECADE = 60  # values of tau: within 4 % of the best, while tau's own error is a quarter or more
DECADES = 4.0  # range of tau below the largest estimated coefficient; smaller ones are negligible


Bias = Mapping[str, Array]  # by fitted unknown, (k,): half intervals of independent components of its bias


def unexplained_biases(model: FullModel, at: FittedModel, elements: Iterable[str] = ()) -> tuple[Bias, ...]:
    """The bias of a fit's shared unknowns by its unexplained residual: t(r) tau B for every profile with tau > 0.

    Half the 95 % interval of an unknown's bias is the root of its sum of squares.

    Parameters
    ----------
    elements : those at fault, where they are known: only profiles of them count, all where they have none.
    """
    every = model.setup.free_profiles
    profiles = [name for name, one in every.items() if set(one.on) & set(elements)] or list(every)
    system, fitted = at.system, model.fitted_unknowns(at.effects)
    beside, found = Projection(system, fitted), []
    known = system.columns_of([*fitted, *system.own])
    for profile in profiles:
        coefficients = system.columns_of(model.amplitudes(profile))
        whole = coefficients @ walk(coefficients.shape[1])
        size, visible = unexplained_size(whole, beside.orthogonal(whole), beside.y)
        if size > 0.0:
            parts = t_quantile(visible) * size * least_squares(known, whole, ROUNDING)
            found.append({n: parts[i] for i, n in enumerate(fitted)})
    return tuple(found)


def walk(knots: int) -> Array:
    """A root L, (k, k), of the covariance of a random walk from the middle knot m, with unit variance there.

    (L L')_ij = 1 + min(|i - m|, |j - m|) / m for i and j on the same side of m, else 1; variances are 1 to 2.
    """
    place = np.arange(knots) - 0.5 * (knots - 1)
    same = np.sign(place)[:, None] == np.sign(place)[None]
    steps = np.minimum(np.abs(place)[:, None], np.abs(place)[None]) / max(0.5 * (knots - 1), 0.5)
    values, axes = np.linalg.eigh(1.0 + np.where(same, steps, 0.0))
    return np.asarray(axes * np.sqrt(np.maximum(values, 0.0)))


def half_widths(found: Sequence[Bias]) -> dict[str, float]:
    """Half the 95 % interval of each unknown's bias, by the profile with the largest one."""
    names = {n for one in found for n in one}
    return {n: max(float(np.linalg.norm(one[n])) for one in found) for n in sorted(names)}


def unexplained_size(whole: Array, left: Array, y: Array) -> tuple[float, int]:
    """The standard deviation of a profile's coefficients, and the number of directions in which they are visible.

    Parameters
    ----------
    whole : (n, k), whitened sensitivities to the coefficients. left : the same, orthogonal to the fitted ones.
    y : (n,), the residual.
    """
    values, axes = np.linalg.eigh(left.T @ left)
    good = values > POLICY.least_visibility**2 * np.sum((whole @ axes) ** 2, axis=0)
    good &= values > ROUNDING * max(float(values[-1]), 1e-300)
    if not good.any() or values[-1] <= 0:
        return 0.0, 0
    estimates = (axes[:, good].T @ (left.T @ y)) / values[good]
    variances = 1.0 / values[good]
    largest = float(np.max(np.abs(estimates)))
    if largest == 0.0:
        return 0.0, int(good.sum())
    tau2 = np.concatenate([[0.0], (largest * np.logspace(-DECADES, 1.0, int(TRIED_PER_DECADE * (DECADES + 1)))) ** 2])
    total = tau2[:, None] + variances[None]
    likelihood = -0.5 * np.sum(np.log(total) + estimates[None] ** 2 / total, axis=1)
    return float(np.sqrt(tau2[int(np.argmax(likelihood))])), int(good.sum())
