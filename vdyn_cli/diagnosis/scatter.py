"""How much a gain would differ from one test day of the same car to another, by the step's model of its noise."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.sheet import Linear
from vdyn_cli.inference import Unknown
from vdyn_cli.inference.qr_factors import Array
from vdyn_cli.inference.regression import prior_rows

DAYS = 400  # that are drawn
SEED = 20170402


@dataclass(frozen=True)
class Doubted:
    """What is predicted wrongly of a run to which nothing was fitted, and how else it might have come out.

    Parameters
    ----------
    error : (p,), of the main channel.
    noise : (p, m), its derivatives to independent units of noise and of the run's own unknowns, new in every run.
    stated : (p, q), to independent units of what is known of the car only so well, the same in every run.
    """

    error: Array
    noise: Array
    stated: Array


def doubted(linear: Linear, run: int, error: Array) -> Doubted | None:
    """The error of a run, where the step has a model of its noise."""
    rows, shared = linear.rows[run], linear.regression.shared
    if rows.plain is None or rows.plain_root is None:
        return None
    slopes, count = rows.plain[1], len(shared)
    of_run = slopes[:, count:] @ _root(linear.regression.own)
    return Doubted(error, np.hstack([rows.plain_root, of_run]), slopes[:, :count] @ _root(shared))


def _root(unknowns: tuple[Unknown, ...]) -> Array:
    """(unknowns, known), a root of the covariance of what is known of them beforehand, as if exact where nothing is."""
    known = [k for k, u in enumerate(unknowns) if u.prior]
    root = np.zeros((len(unknowns), len(known)))
    root[known] = np.linalg.inv(prior_rows(unknowns, np.zeros(len(unknowns)))[:, known])
    return root


def scatter(before: Sequence[Doubted], after: Sequence[Doubted]) -> float:
    """The variance of the fall of the root mean square, from day to day.

    With d what the cause changes in a run's prediction, S z what is stated wrongly of the car, on all days alike, and
    N e the noise of a day, drawn anew for each::

        fall(e) = rms(d + S z + N e) - rms(S z + N e) over all runs,   variance = E (fall(e1) - fall(e2))^2 / 2

    The errors as they came out on the one day are not used: by chance they may all lie along d.
    """
    rng = np.random.default_rng(SEED)
    stated = rng.standard_normal((after[0].stated.shape[1], DAYS))
    falls = []
    for _ in range(2):
        squares, count = np.zeros((2, DAYS)), 0
        for b, a in zip(before, after, strict=True):
            wrong = a.stated @ stated + a.noise @ rng.standard_normal((a.noise.shape[1], DAYS))
            changed = wrong + (b.error - a.error)[:, None]
            squares += np.sum(changed**2, axis=0), np.sum(wrong**2, axis=0)
            count += len(wrong)
        roots = np.sqrt(squares / count)
        falls.append(roots[0] - roots[1])
    return float(np.mean((falls[0] - falls[1]) ** 2) / 2)
