"""The variance of a gain from one test day of the same car to another, by the step's model of its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.linearized_system import LinearizedRuns
from vdyn_cli.inference import Unknown
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array

DAYS = 400  # draws: the variance is then known to 7 %, sqrt(2/400)
SEED = 20170402  # any number: it makes the same data give the same interval


@dataclass(frozen=True)
class PredictionError:
    """The error of a run's prediction to which nothing was fitted, and the sensitivities to its random causes.

    Parameters
    ----------
    error : (p,), of the main channel.
    noise : (p, m), to independent unit noise and to the run's own unknowns, drawn anew for every run.
    stated : (p, q), to independent units of the priors' uncertainty, the same in every run.
    names : (q,) of the unknowns with these priors. Folds that select different effects have different ones.
    """

    error: Array
    noise: Array
    stated: Array
    names: tuple[str, ...]


def prediction_error(runs: LinearizedRuns, run: int, error: Array) -> PredictionError | None:
    """The error of a run with its sensitivities; None where the step has no model of the noise.

    Parameters
    ----------
    run : index of the run. error : (n,) prediction minus measurement, in the units of the data.
    """
    rows, shared = runs.rows[run], runs.regression.shared
    if rows.plain is None or rows.plain_root is None:
        return None
    slopes, count = rows.plain[1], len(shared)
    of_run = slopes[:, count:] @ _root(runs.regression.own)
    names = tuple(u.name for u in shared if u.prior)
    return PredictionError(error, np.hstack([rows.plain_root, of_run]), slopes[:, :count] @ _root(shared), names)


def _root(unknowns: tuple[Unknown, ...]) -> Array:
    """(unknowns, with priors), a root of the covariance of the priors; unknowns without a prior count as exact."""
    known = [k for k, u in enumerate(unknowns) if u.prior]
    root = np.zeros((len(unknowns), len(known)))
    root[known] = np.linalg.inv(prior_rows(unknowns, np.zeros(len(unknowns)))[:, known])
    return root


def day_to_day_variance(before: Sequence[PredictionError], after: Sequence[PredictionError]) -> float:
    """The variance of the reduction of the root mean square error, from day to day.

    With d what the effect changes in a run's prediction, S z the error by the stated parameters, the same on all days,
    and N e the noise of a day, drawn anew for each::

        reduction(e) = rms(d + S z + N e) - rms(S z + N e) over all runs
        variance = E (reduction(e1) - reduction(e2))^2 / 2

    The errors of the one day are not used: by chance they may all lie along d.
    """
    rng = np.random.default_rng(SEED)
    names = dict.fromkeys(n for a in after for n in a.names)
    stated = {n: rng.standard_normal(DAYS) for n in names}  # one error a name, in every fold that has it
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
