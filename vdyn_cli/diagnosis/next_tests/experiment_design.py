"""The expected separation of effects after a planned manoeuvre, from the Cramer-Rao bound.

The sensitivities in the driven runs are stacked on those in the manoeuvre's simulated runs. The sensitivity s q of an
effect of amplitude q, made orthogonal to the fitted unknowns and the rival, has as its norm the t of the effect in
standard errors: t^2 = q' (I_cc - I_cb I_bb^-1 I_bc) q, with the information I of all runs together. Assumes that wind,
road and car stay as they were, except for what the manoeuvre changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from math import sqrt

import numpy as np

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.strategies.full_model import FullModel
from vdyn_cli.diagnosis.strategies.linearized_system import linearize, rows_of_run
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference.qr_factors import orthonormal, qr_factor
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.manoeuvre import Manoeuvre

ROUNDING = 1e-6  # share of a sensitivity's norm


@dataclass(frozen=True)
class Contrast:
    """Amplitudes of effects, by unknown, to be detected while the unknowns ``beside`` are fitted."""

    amplitudes: Mapping[str, float]
    beside: tuple[str, ...]


def fitted_beside(model: FullModel, effects: Sequence[str]) -> tuple[str, ...]:
    """The unknowns that are fitted: those of the baseline and the amplitudes of these effects."""
    return (*model.base_unknowns, *(n for e in effects for n in model.amplitudes(e)))


def typical_contrast(model: FullModel, effect: str, others: Sequence[str]) -> Contrast:
    """The effect at ``typical_share`` of its largest plausible amplitude, while ``others`` are fitted."""
    unknown = model.amplitudes(effect)[0]
    amplitude = POLICY.typical_share * largest_plausible(model.setup.candidates[effect], unknown)
    return Contrast({unknown: amplitude}, fitted_beside(model, others))


@dataclass(frozen=True)
class PlannedTest:
    """A manoeuvre driven with ``runs`` runs, and the expected separation ``t`` in standard errors."""

    manoeuvre: Manoeuvre
    runs: int
    t: float

    @property
    def text(self) -> str:
        """The manoeuvre with its number of runs, as a noun phrase."""
        return self.manoeuvre.words(self.runs)


@dataclass
class ExperimentDesigner:
    """The information of the driven runs and of the step's manoeuvres, which are simulated when first needed.

    Parameters
    ----------
    times : number of planned runs over number of driven runs, for plans that repeat them.
    """

    strategy: Strategy
    times: float = 1.0

    @cached_property
    def _names(self) -> list[str]:
        return [u.name for u in self.strategy.model.regression.shared]

    @cached_property
    def _driven(self) -> tuple[Array, Array]:
        """Rows over the shared unknowns: those of the runs, with their own unknowns eliminated, and of the priors."""
        system, s = self.strategy.base.system, len(self._names)
        own = system.columns[:, s:]
        known = (system.run[system.label] < 0) & ~own.any(axis=1)
        driven = np.column_stack([own[~known], system.columns[~known, :s]])
        return sqrt(self.times) * _eliminated(driven, own.shape[1]), system.columns[known, :s]

    @property
    def manoeuvres(self) -> tuple[Manoeuvre, ...]:
        """The manoeuvres that could be simulated, the least effort first."""
        return tuple(one for one, _ in self._manoeuvres)

    @cached_property
    def _manoeuvres(self) -> list[tuple[Manoeuvre, Array]]:
        """Each manoeuvre with its rows over the shared unknowns; those whose simulation fails are left out."""
        made, model = [], self.strategy.model
        for one in model.setup.manoeuvres(model.regression, self.strategy.base.values):
            try:
                made.append((one, self._simulated(one)))
            except (ResultError, ArithmeticError):
                continue
        return made

    def _simulated(self, one: Manoeuvre) -> Array:
        regression = one.regression()
        own = regression.own
        starts = {u.name: regression.run_starts.get(u.name, np.full(len(regression.runs), u.start)) for u in own}
        linear = linearize(regression, self.strategy.base.values, starts, self.strategy.secants(()))
        every = (np.vstack(rows_of_run(linear, k))[:, :-1] for k in range(len(regression.runs)))
        whole = np.vstack([_eliminated(rows, len(own)) for rows in every])
        anew = np.array([u.name in one.anew for u in regression.shared])
        left = _eliminated(np.column_stack([whole[:, anew], whole[:, ~anew]]), int(anew.sum()))
        rows_left = np.zeros((len(left), anew.size))
        rows_left[:, ~anew] = left
        return rows_left

    def driven_separation(self, contrasts: Sequence[Contrast], times: float = 1.0) -> float:
        """The ``separation`` t by the driven runs, or ``times`` as many; without priors it grows with sqrt(times)."""
        return self.separation(self._driven[0] * sqrt(times), contrasts)

    def best(self, contrasts: Sequence[Contrast]) -> PlannedTest | None:
        """The manoeuvre that separates with the fewest runs, of equal ones that of least effort; else the best one.

        None where the step has no manoeuvres.
        """
        found = [self._planned(one, rows, contrasts) for one, rows in self._manoeuvres]
        enough = [plan for plan in found if plan.t >= POLICY.separated_t]
        return min(enough, key=lambda p: p.runs) if enough else max(found, key=lambda p: round(p.t, 1), default=None)

    def after(self, manoeuvre: Manoeuvre, times: int) -> Array:
        """Rows over the shared unknowns of the driven runs and ``times`` a manoeuvre, or the driven runs again.

        The latter for a manoeuvre that is not one of ``manoeuvres``.
        """
        added = next((rows for one, rows in self._manoeuvres if one is manoeuvre), self._driven[0])
        return np.vstack([self._driven[0], sqrt(times) * added])

    def spread(self, rows: Array | None = None) -> dict[str, float]:
        """Standard error of each unknown of the baseline by ``rows`` (default: of the driven runs) and the priors.

        s^2 = diag((J'J)^-1), the Cramer-Rao bound; practically infinite where nothing determines the unknown.
        """
        base = self.strategy.model.base_unknowns
        driven, known = self._driven
        whole = np.vstack([driven if rows is None else rows, known])[:, : len(base)]
        size = np.linalg.norm(whole, axis=0)
        size[size == 0.0] = 1.0
        _, values, right = np.linalg.svd(whole / size, full_matrices=False)
        inverse = right.T / np.maximum(values, np.finfo(float).tiny)
        return dict(zip(base, (np.linalg.norm(inverse, axis=1) / size).tolist(), strict=True))

    def _planned(self, one: Manoeuvre, rows: Array, contrasts: Sequence[Contrast]) -> PlannedTest:
        for times in range(1, one.most + 1):
            t = self.separation(np.vstack([self._driven[0], sqrt(times) * rows]), contrasts)
            if t >= POLICY.separated_t:
                break
        return PlannedTest(one, times * one.each, t)

    def separation(self, rows: Array, contrasts: Sequence[Contrast]) -> float:
        """The separation t by ``rows`` and the priors, in standard errors, of the least separated contrast.

        t = |(1 - P) J a|, with a the amplitudes of the contrast and P the projection onto the effects beside it

        Parameters
        ----------
        rows : J, (k, s), whitened sensitivities to the shared unknowns, such as those of ``after``.
        contrasts : 0 without any.
        """
        known = self._driven[1]
        every = np.vstack([rows, known])
        return min((self._separation(every, len(known), one) for one in contrasts), default=0.0)

    def _separation(self, rows: Array, known: int, contrast: Contrast) -> float:
        """The norm of the remaining sensitivity; zero where the detection would call the effect collinear."""
        at = {n: i for i, n in enumerate(self._names)}
        whole = rows[:, [at[n] for n in contrast.amplitudes]] @ np.array(list(contrast.amplitudes.values()))
        basis = orthonormal(rows[:, [at[n] for n in contrast.beside]])
        left = whole - basis @ (basis.T @ whole)
        length, remains = float(np.linalg.norm(whole)), float(np.linalg.norm(left))
        if remains <= ROUNDING * length:
            return 0.0
        stated = float(left[len(left) - known :] @ left[len(left) - known :]) / remains**2
        trusted = remains > POLICY.least_visibility * length or stated > POLICY.prior_information
        return remains if trusted else 0.0


def _eliminated(rows: Array, first: int) -> Array:
    """Rows with the same information about the other columns after the first ones are fitted."""
    return qr_factor(rows)[first:, first:]
