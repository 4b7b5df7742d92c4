"""What the drives say of each parameter, beside what was known of it.

The whitened rows of all outputs and the prior make one least squares problem. It is solved with the derivatives at the
prior (the chord method: each further step costs a simulation without derivatives), each stretch's own unknowns
eliminated. With the information F of the drives, the prior covariance P and the move d that they ask for::

    strain of a parameter    d_i / sqrt(P_ii - C_ii),  C = (P^-1 + F)^-1

is a standard normal number where model and prior are right: the estimate moves by that much or more in 32 of 100 cases
beyond 1, in 5 beyond 2. Likewise each direction of parameters that the drives see: q = u'L's / sqrt(f + f^2) with s the
scores, L L' = P and f, u the eigenvalues and vectors of L'F L; the sum of their squares is a chi-square number with as
many degrees of freedom as there are directions with f > 1, however many samples were logged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate.regression import Weighed
from vdyn_cli.steps.validate.trial import Outcome, Trial

Array = NDArray[np.float64]

STEPS = 4  # of the chord method, at most
SETTLED = 0.03  # standard deviations of the posterior that a further step may ask for
SEEN = 1.0  # information of the drives over that of the prior, from which a direction is seen
NEGLIGIBLE = 0.1  # share of the prior's variance: what the drives take away less of, they do not see


@dataclass(frozen=True, eq=False)
class Posterior:
    """The parameters after the drives, in the order of the beliefs (k).

    Parameters
    ----------
    values, std : after the drives. strain : of each parameter, NaN where the drives do not see it.
    told : (k,) share of the prior's variance that the drives took away.
    own : (stretches, m) start speed and zeros of each stretch.
    statistic, degrees, chance : of the move as a whole; chance that a right model moves so far.
    white : mean square of the whitened rows after the move, by stretch.
    settled : whether the steps came to rest.
    """

    values: Array
    std: Array
    strain: Array
    told: Array
    own: Array
    statistic: float
    degrees: int
    chance: float
    white: Array
    settled: bool


def posterior(w: Weighed) -> Posterior:
    """Weigh the drives with the prior."""
    regression, trial = w.regression, w.trial
    s, m = len(regression.shared), len(regression.own)
    known = prior_rows(regression.shared, np.zeros(s))[:, :-1]
    held = prior_rows(regression.own, np.zeros(m))[:, :-1]
    count = range(len(trial.stretches))
    starts = [w.start(k) for k in count]
    shared, own = trial.theta(), np.array([x[s:] for x in starts])
    rows = [w.white(k, w.first[k], float(own[k, 0])) for k in count]
    jacobians = [r.jacobian for r in rows]
    solver = _Arrowhead(jacobians, known, held, s)
    centre, settled = shared.copy(), False
    residuals = [r.residual for r in rows]
    first = None
    for step in range(STEPS + 1):
        pulls = [j.T @ r for j, r in zip(jacobians, residuals, strict=True)]
        zeros = own @ (held.T @ held)  # their priors are about zero; a start speed has none
        moved, own_moved = solver.step(pulls, known.T @ (known @ (shared - centre)), zeros)
        if first is None:
            first = solver.reduced_pull(pulls, zeros)
        if np.max(np.abs(moved) / solver.std) < SETTLED:
            settled = True
            break
        if step == STEPS:
            break
        shared, own = shared + moved, own + own_moved
        try:
            outcomes = trial.each(_simulated(trial, shared, own))
        except ResultError:
            shared, own = shared - moved, own - own_moved
            break
        residuals = [
            w.white(k, o, float(own[k, 0]), slopes=False).residual for k, o in zip(count, outcomes, strict=True)
        ]
    assert first is not None
    return _told(w, solver, shared, own, first, residuals, settled)


def _simulated(trial: Trial, shared: Array, own: Array) -> Callable[[int], Outcome]:
    return lambda k: trial.simulate(k, np.r_[shared, own[k]], slopes=False)


class _Arrowhead:
    """Normal equations of shared unknowns and each stretch's own."""

    def __init__(self, jacobians: list[Array], known: Array, held: Array, s: int) -> None:
        self.s, self.prior = s, known.T @ known
        self.blocks = []
        self.information = np.zeros((s, s))
        for j in jacobians:
            normal = j.T @ j
            a, b, c = normal[:s, :s], normal[:s, s:], normal[s:, s:] + held.T @ held
            c = c + 1e-9 * np.diag(np.diag(c)) + 1e-12 * np.eye(len(c))
            follow = np.linalg.solve(c, b.T) if len(c) else np.zeros((0, s))
            self.blocks.append((b, c, follow))
            self.information += a - b @ follow
        self.covariance = np.linalg.inv(self.prior + self.information)
        self.std = np.sqrt(np.diag(self.covariance))

    def reduced_pull(self, pulls: list[Array], own_prior: Array) -> Array:
        """Scores of the shared unknowns with each stretch's own eliminated."""
        total = np.zeros(self.s)
        for (_, _, follow), pull, prior in zip(self.blocks, pulls, own_prior, strict=True):
            total += pull[: self.s] - follow.T @ (pull[self.s :] + prior)
        return total

    def step(self, pulls: list[Array], shared_prior: Array, own_prior: Array) -> tuple[Array, Array]:
        right = self.reduced_pull(pulls, own_prior) + shared_prior
        moved = -self.covariance @ right
        own = [
            -np.linalg.solve(c, pull[self.s :] + prior + b.T @ moved) if len(c) else np.zeros(0)
            for (b, c, _), pull, prior in zip(self.blocks, pulls, own_prior, strict=True)
        ]
        return moved, np.array(own)


def _told(
    w: Weighed, solver: _Arrowhead, shared: Array, own: Array, first: Array, residuals: list[Array], settled: bool
) -> Posterior:
    from scipy.special import chdtrc

    beliefs = w.trial.beliefs
    k = len(beliefs.names)
    values, std = shared[:k], solver.std[:k]
    gone = np.maximum(beliefs.std**2 - std**2, 0.0)
    told = gone / beliefs.std**2
    seen = told > NEGLIGIBLE
    prior = np.array([beliefs.values[n] for n in beliefs.names])
    strain = np.where(seen, (values - prior) / np.sqrt(np.where(seen, gone, 1.0)), np.nan)
    root = beliefs.root
    f, u = np.linalg.eigh(root.T @ solver.information[:k, :k] @ root)
    strong = f > SEEN
    q = (u.T @ root.T @ first[:k])[strong] / np.sqrt(f[strong] + f[strong] ** 2)
    statistic, degrees = float(q @ q), int(strong.sum())
    chance = float(chdtrc(degrees, statistic)) if degrees else 1.0
    white = np.array([float(np.mean(r**2)) for r in residuals])
    return Posterior(values, std, strain, told, own, statistic, degrees, chance, white, settled)
