"""The variance of a held-out gain between test days of the same car, by the step's noise model."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedRuns
from vdyn_cli.inference import Unknown
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array

DAYS = 400  # draws: the standard error of the variance is then 7 %, sqrt(2/400)
SEED = 20170402  # arbitrary and fixed, so that the same data give the same interval


@dataclass(frozen=True)
class PredictionError:
    """The error of a prediction to which nothing was fitted, and its sensitivities to random variables.

    Parameters
    ----------
    error : (p,), error of the main channel.
    noise : (p, m), sensitivities to independent unit normals that differ in every run: noise and own unknowns.
    stated : (p, q), sensitivities to independent unit normals of the priors, the same in every run.
    names : (q,), unknowns with these priors. They differ between folds that select different effects.
    """

    error: Array
    noise: Array
    stated: Array
    names: tuple[str, ...]


def prediction_error(runs: LinearizedRuns, run: int, error: Array) -> PredictionError | None:
    """The prediction error of a run with its sensitivities; None if the step has no noise model.

    ``error``: (n,), prediction minus measurement of the main channel.
    """
    rows, shared = runs.rows[run], runs.regression.shared
    if rows.plain is None or rows.plain_root is None:
        return None
    slopes, count = rows.plain[1], len(shared)
    of_run = slopes[:, count:] @ _root(runs.regression.own)
    names = tuple(u.name for u in shared if u.prior)
    return PredictionError(error, np.hstack([rows.plain_root, of_run]), slopes[:, :count] @ _root(shared), names)


def _root(unknowns: tuple[Unknown, ...]) -> Array:
    """A root (unknowns, priors) of the covariance of the priors; without a prior, an unknown is exact."""
    known = [k for k, u in enumerate(unknowns) if u.prior]
    root = np.zeros((len(unknowns), len(known)))
    root[known] = np.linalg.inv(prior_rows(unknowns, np.zeros(len(unknowns)))[:, known])
    return root


def day_to_day_variance(before: Sequence[PredictionError], after: Sequence[PredictionError]) -> float:
    """The variance of the reduction of the root mean square error between test days.

    With d the change of a run's prediction by the effect, S z the error by the stated parameters, the same on all days,
    and N e the noise, drawn for each day::

        reduction(e) = rms(d + S z + N e) - rms(S z + N e) over all runs
        variance = E (reduction(e1) - reduction(e2))^2 / 2

    The measured errors are not used, since by chance they may all lie along d.
    """
    rng = np.random.default_rng(SEED)
    names = dict.fromkeys(n for a in after for n in a.names)
    stated = {n: rng.standard_normal(DAYS) for n in names}  # the error of an unknown is the same in all folds
    reductions = []
    for _ in range(2):
        squares, count = np.zeros((2, DAYS)), 0
        for b, a in zip(before, after, strict=True):
            drawn = np.array([stated[n] for n in a.names]).reshape(len(a.names), DAYS)
            error = a.stated @ drawn + a.noise @ rng.standard_normal((a.noise.shape[1], DAYS))
            without = error + (b.error - a.error)[:, None]
            squares += np.sum(without**2, axis=0), np.sum(error**2, axis=0)
            count += len(error)
        roots = np.sqrt(squares / count)
        reductions.append(roots[0] - roots[1])
    return float(np.mean((reductions[0] - reductions[1]) ** 2) / 2)
