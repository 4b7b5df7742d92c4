"""The posterior of each parameter from prior and drives, and whether the two contradict each other.

The whitened rows of all outputs and the prior form one least-squares problem. It is solved with the derivatives at the
prior (chord method: each further step costs a simulation without derivatives) and with each segment's own unknowns
and the errors of channels eliminated. With the information F of the drives, the prior covariance P and the change d of
the estimates::

    pull of a parameter    d_i / sqrt(P_ii - C_ii),  C = (P^-1 + F)^-1

is standard normal if model and prior are correct: beyond +-1 in 32 % of cases, beyond +-2 in 5 %. The same holds for
each direction of the parameter space: q = u'L's / sqrt(f + f^2) with s the scores, L L' = P and f, u the eigenvalues
and eigenvectors of L'F L. The sum of q^2 over the directions with f > 1 is chi-square distributed with their number as
degrees of freedom, however many samples were logged.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate.car.prior import ParameterPrior
from vdyn_cli.steps.validate.car.simulation import SimulatedSegment, SimulationSetup
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives

CHORD_STEPS = 4  # of the chord method, at most
SETTLED = 0.03  # standard deviations of the posterior: a smaller step ends the iteration
SEEN = 1.0  # information of the drives over that of the prior, from which a direction is tested
NEGLIGIBLE = 0.1  # reduction of the prior variance, as a share, below which no pull is stated


@dataclass(frozen=True, eq=False)
class Posterior:
    """The parameters after the drives, in the order of the prior (k).

    Parameters
    ----------
    values, std : (k,) after the drives, SI. pull : (k,) change of each parameter by the drives over the standard
        deviation of that change, NaN where the drives hardly inform it.
    reduction : (k,) share of the prior's variance that the drives remove.
    statistic, degrees, chance : chi-square statistic of the move as a whole, its degrees of freedom and p value.
    """

    values: Array
    std: Array
    pull: Array
    reduction: Array
    statistic: float
    degrees: int
    chance: float


def posterior(w: WhitenedDrives) -> Posterior:
    """The posterior of the parameters from prior and drives.

    m_post = m + C_post (J' r - C^-1 (m - m0)),   C_post^-1 = C^-1 + J' J

    repeated until m (k,) changes by less than ``SETTLED`` standard deviations, at most ``CHORD_STEPS`` times, with m0
    and C the prior's mean and covariance (k, k), r the whitened residuals, measured minus simulated, and J (rows, k)
    the whitened sensitivities. Each segment's own unknowns are eliminated.

    Parameters
    ----------
    w : whitened residuals and sensitivities of all drives, with the prior.

    Raises
    ------
    LinAlgError : prior and drives leave a combination of the parameters without information.

    Notes
    -----
    The sensitivities are those at the start; the residuals are simulated again after every step of the fit. Assumes
    that the sensitivities change little over the change of the parameters.
    """
    regression, setup = w.regression, w.setup
    s, m = len(regression.shared), len(regression.own)
    known = prior_rows(regression.shared, np.zeros(s))[:, :-1]
    held = prior_rows(regression.own, np.zeros(m))[:, :-1]
    count = range(len(setup.segments))
    start = setup.vector.theta
    shared, own = start.copy(), np.array([setup.vector.start(k)[s:] for k in count])
    rows = w.at_start
    system = _BorderedSystem([r.jacobian for r in rows], known, held)
    residuals, scores = [r.residual for r in rows], None
    for step in range(CHORD_STEPS + 1):
        gradients = np.array([r.jacobian.T @ residual for r, residual in zip(rows, residuals, strict=True)])
        zeros = own @ (held.T @ held)  # their priors are about zero; a start speed has none
        if scores is None:
            scores = system.reduced_gradient(gradients, zeros)
        moved, own_moved = system.step(gradients, known.T @ (known @ (shared - start)), zeros)
        if step == CHORD_STEPS or np.max(np.abs(moved) / system.std) < SETTLED:
            break
        try:
            outcomes = setup.each(_simulated(setup, shared + moved, own + own_moved))
        except ResultError:
            break
        shared, own = shared + moved, own + own_moved
        residuals = [w.white(k, outcomes[k], float(own[k, 0]), slopes=False).residual for k in count]
    assert scores is not None
    return _pulls(w.setup.prior, system, shared, scores)


def _simulated(setup: SimulationSetup, shared: Array, own: Array) -> Callable[[int], SimulatedSegment]:
    return lambda k: setup.simulate(k, np.r_[shared, own[k]], slopes=False)


class _BorderedSystem:
    """Bordered normal equations of the shared unknowns and of each segment's own."""

    def __init__(self, jacobians: list[Array], known: Array, held: Array) -> None:
        self.s = s = known.shape[1]
        normal = np.array([j.T @ j for j in jacobians])
        own, unit = normal[:, s:, s:] + held.T @ held, np.eye(len(held.T))
        self.border, self.own = normal[:, :s, s:], own * (1 + 1e-9 * unit) + 1e-12 * unit
        self.follow = np.linalg.solve(self.own, self.border.swapaxes(1, 2))
        self.information = np.sum(normal[:, :s, :s] - self.border @ self.follow, axis=0)
        self.prior = known.T @ known
        self.covariance = np.linalg.inv(self.prior + self.information)
        self.std = np.sqrt(np.diag(self.covariance))

    def reduced_gradient(self, gradients: Array, own_prior: Array) -> Array:
        """Scores (s,) of the shared unknowns with each segment's own eliminated.

        Parameters
        ----------
        gradients : (segments, s + m). own_prior : (segments, m) gradients of the priors of the own unknowns.
        """
        own = gradients[:, self.s :] + own_prior
        return np.asarray(np.sum(gradients[:, : self.s] - np.einsum("kms,km->ks", self.follow, own), axis=0))

    def step(self, gradients: Array, shared_prior: Array, own_prior: Array) -> tuple[Array, Array]:
        """Newton steps of shared (s,) and own (segments, m) unknowns from the gradients of rows and priors."""
        right = self.reduced_gradient(gradients, own_prior) + shared_prior
        moved = -self.covariance @ right
        right_own = gradients[:, self.s :] + own_prior + moved @ self.border
        return moved, -np.linalg.solve(self.own, right_own[:, :, None])[:, :, 0]


def _pulls(prior: ParameterPrior, system: _BorderedSystem, shared: Array, scores: Array) -> Posterior:
    """The posterior with the pull of each parameter and the statistic of all; ``scores`` at the prior."""
    from scipy.special import chdtrc

    k = len(prior.names)
    values, std = shared[:k], system.std[:k]
    gone = np.maximum(prior.std**2 - std**2, 0.0)
    reduction = gone / prior.std**2
    seen = reduction > NEGLIGIBLE
    before = np.array([prior.values[n] for n in prior.names])
    pull = np.where(seen, (values - before) / np.sqrt(np.where(seen, gone, 1.0)), np.nan)
    root, information, others = prior.root, system.information, system.information[k:, :k]
    share = np.linalg.lstsq(information[k:, k:] + system.prior[k:, k:], others, rcond=None)[0]  # of errors of channels
    f, u = np.linalg.eigh(root.T @ (information[:k, :k] - share.T @ others) @ root)
    strong = f > SEEN
    q = (u.T @ root.T @ (scores[:k] - share.T @ scores[k:]))[strong] / np.sqrt(f[strong] + f[strong] ** 2)
    statistic, degrees = float(q @ q), int(strong.sum())
    chance = float(chdtrc(degrees, statistic)) if degrees else 1.0
    return Posterior(values, std, pull, reduction, statistic, degrees, chance)
