"""Searches the part of the model at fault: gives each element's law a free addition and compares the evidence.

The additions of all parts are linearized about the baseline's fit in one pass. A part's evidence is its marginal
likelihood, which penalizes flexibility, so that parts with any number of coefficients can be compared with each other
and with the effects of the catalog. The most likely parts are then refitted nonlinearly, with the prior of smoothness
that maximizes the evidence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from math import inf

import numpy as np

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import amplitudes_of, unknowns_of
from vdyn_cli.diagnosis.strategies.full_model import LEAST_STEP
from vdyn_cli.diagnosis.strategies.linearized_system import LinearizedSystem, Projection, linearize, linearized_system
from vdyn_cli.diagnosis.strategies.strategy import Strategy
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.inference.function_prior import FunctionEvidence, best_evidence, function_evidence
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.inference.qr_factors import orthonormal
from vdyn_cli.inference.regression import prior_rows
from vdyn_cli.inference.restrict import restricted, without_priors
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps import SimulatedProblem
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.free_part import Part

NO_VARIANCE = np.zeros(0)
MOST_ITERATIONS = 25  # of a refit: slow convergence along a kink is cut off, and the fit so far is used


@dataclass(frozen=True)
class FittedParts:
    """The baseline with the free additions of some parts of one element.

    Parameters
    ----------
    parts : of one element over one coordinate; none for the baseline alone.
    effects : of the catalog, in the fit instead of parts.
    solution : of the fit; its priors keep the additions smooth.
    squares : sum of squares of the residuals, without the penalty of the additions' priors.
    gain : log evidence of the fit over the baseline.
    variance : prior variances of the coefficients. freedom : effective number of free coefficients.
    """

    parts: tuple[Part, ...]
    effects: tuple[str, ...]
    solution: Solution
    squares: float
    gain: float
    variance: Array
    freedom: float

    def variance_of(self, part: Part) -> Array:
        """The prior variances (k,) of one part's coefficients."""
        place, count = [p.name for p in self.parts].index(part.name), len(part.unknowns)
        return self.variance[place * count : (place + 1) * count]


@dataclass(frozen=True)
class PartSearch:
    """The regression with all parts and candidates, and the evidence of each part by its linearization.

    Parameters
    ----------
    regression : baseline, candidates, and coefficients of all parts without priors.
    base : names of the baseline's shared unknowns.
    start : the baseline's solution.
    parts : all parts of the step.
    gains : evidence of every set of parts, the largest first.
    rivals : evidence of every candidate effect, on the same scale.
    floor : variance of the whitened residual with all parts and candidates: 1 where the noise model is valid.
    """

    strategy: Strategy
    regression: Regression
    base: tuple[str, ...]
    start: Solution
    parts: tuple[Part, ...]
    gains: tuple[tuple[tuple[Part, ...], FunctionEvidence], ...]
    rivals: Mapping[str, FunctionEvidence]
    floor: float

    def noise(self, fitted: FittedParts) -> float:
        """Noise variance of a whitened row: the smaller of ``floor`` and that of a fit."""
        return min(self.floor, solution_floor(fitted.solution))

    @property
    def most_gain(self) -> float:
        """The log evidence over the baseline of a fit that leaves only noise."""
        return (self.start.cost - 0.5 * self.floor * len(self.start.residuals)) / self.floor

    def explained(self, fitted: FittedParts) -> float:
        """Reduction of the sum of squares by a fit, beyond what its free coefficients explain by chance."""
        return 2 * self.start.cost - fitted.squares - self.noise(fitted) * fitted.freedom

    def explained_share(self, fitted: FittedParts) -> float:
        """Squares explained by a fit, as a share of these plus those that the best addition would explain; 0 to 1."""
        explained = self.explained(fitted)
        return float(np.clip(explained / max(explained + self.rest(fitted), 1e-12), 0.0, 1.0))

    def rest(self, fitted: FittedParts) -> float:
        """Squares that the best other part or candidate would explain beside the fitted parts; 0 if not significant."""
        regression, names = self._smooth(fitted.parts, fitted.variance)
        try:
            system = linearized_system(linearize(regression, fitted.solution.values, fitted.solution.per_run))
        except (ResultError, ArithmeticError):
            return 0.0
        projected = Projection(system, [*self.base, *names])
        others = [p for p in self.parts if p.group != fitted.parts[0].group]
        gains, rivals = _gains(self.strategy, projected, others, self.noise(fitted))
        beside = [e for _, e in gains] + [
            e for n, e in rivals.items() if not fitted.parts[0].concerns(self.strategy.model.setup.candidates[n])
        ]
        return max((e.explained * self.noise(fitted) for e in beside if e.gain > POLICY.clearly_better), default=0.0)

    def share_of_part(self, law: FittedParts, part: FittedParts) -> float:
        """The rms error that a law explains, as a share of that which the part explains, 0 to 1."""
        return rms_share(self.explained(law) / max(self.explained(part), 1e-12))

    def refitted(
        self, parts: Sequence[Part], by: FunctionEvidence, near: FittedParts | None = None
    ) -> FittedParts | None:
        """The nonlinear fit with these parts free; None where it fails.

        Parameters
        ----------
        by : the evidence with the prior of the additions. near : a fit from which this one starts.
        """
        regression, names = self._smooth(parts, by.variance)
        solution = self._solved(regression, names, near.solution if near is not None else self.start)
        return None if solution is None else self._compared(solution, regression, parts=parts, variance=by.variance)

    def fitted_baseline(self) -> Solution | None:
        """The baseline fitted with the noise of the search's regression; None where the fit fails."""
        return self._solved(self.regression, (), self.start)

    def _smooth(self, parts: Sequence[Part], variance: Array) -> tuple[Regression, list[str]]:
        """The regression with the priors of these parts' coefficients, without bounds, and the coefficients' names."""
        names = [n for p in parts for n in p.unknowns]
        priors = dict(zip(names, np.sqrt(variance).tolist(), strict=True))

        def smooth(u: Unknown) -> Unknown:
            return replace(u, prior=(0.0, priors[u.name]), lower=-np.inf, upper=np.inf)

        return self.regression.changed(smooth, priors), names

    def with_effects(self, effects: Sequence[str], below: float = inf) -> FittedParts | None:
        """The fit with these effects of the catalog; None where it fails, or ends early since it stays not ``below``.

        It is the strategy's own fit, except where that is linearized about other values than the parts.
        """
        known, model = self.strategy.fitted(effects, below), self.strategy.model
        if self.strategy.nonlinear:
            return None if known is None else self._compared(known.solution, model.regression, effects)
        freed = [n for e in effects for n in model.freed(e)]
        solution = self._solved(self.regression, freed, self.start if known is None else known.solution)
        return None if solution is None else self._compared(solution, self.regression, effects)

    def _solved(self, regression: Regression, freed: Sequence[str], begin: Solution) -> Solution | None:
        """The solution with these unknowns free beside the baseline's, started at ``begin``; None where it fails."""
        values, free = begin.values, {*self.base, *freed}
        shapes = {n for e in self.strategy.model.setup.effects for n in e.nominal}
        held = {u.name: u.start if u.name in shapes else 0.0 for u in regression.shared if u.name not in free}

        # Held unknowns start at their held value, so that the simulation can omit them.
        def started(u: Unknown) -> Unknown:
            return replace(u, start=held.get(u.name, float(np.clip(values.get(u.name, u.start), u.lower, u.upper))))

        begun = restricted(regression.changed(started), held, begin)
        try:
            return solve(begun, tolerance=LEAST_STEP, most_iterations=MOST_ITERATIONS, unconverged=True)
        except (ResultError, ArithmeticError):
            return None

    def _compared(
        self,
        solution: Solution,
        regression: Regression,
        effects: Sequence[str] = (),
        parts: Sequence[Part] = (),
        variance: Array = NO_VARIANCE,
    ) -> FittedParts:
        """A solution of a regression with the evidence of its additions over the baseline."""
        added = [u for u in regression.shared if u.name in solution.names and u.name not in self.start.names]
        known = prior_rows(tuple(added), np.array([solution.values[u.name] for u in added]))
        at = [solution.names.index(u.name) for u in added]
        covariance = solution.classical_covariance[np.ix_(at, at)] / solution_floor(solution)
        # Eigenvalues of the posterior covariance relative to the prior's.
        shrunk = np.clip(np.linalg.eigvalsh(known[:, :-1] @ covariance @ known[:, :-1].T), 1e-12, 1.0)
        floor = min(self.floor, solution_floor(solution))
        return FittedParts(
            tuple(parts),
            tuple(effects),
            solution,
            squares=2 * solution.cost - float(np.sum(known[:, -1] ** 2)),
            gain=(self.start.cost - solution.cost) / floor + 0.5 * float(np.sum(np.log(shrunk))),
            variance=variance,
            freedom=len(added) - float(np.sum(shrunk)),
        )


def rms_share(squares: float) -> float:
    """The share of an rms error that is explained with this share of its sum of squares: 1 - sqrt(1 - squares)."""
    return 1.0 - float(np.sqrt(1.0 - np.clip(squares, 0.0, 1.0)))


def solution_floor(solution: Solution) -> float:
    """Variance of a whitened row at a solution: the sum of squares over the rows less the unknowns, at least one."""
    rows = sum(r.size for r in solution.residuals)
    return max(1.0, 2 * solution.cost / max(rows - len(solution.names), 1))


def part_search(strategy: Strategy, problem: SimulatedProblem) -> PartSearch | None:
    """The evidence of every part beside the baseline's fit; None where the step cannot be linearized with them."""
    base, parts = strategy.base, problem.parts
    regression = _regression(strategy, problem)
    try:
        system = linearized_system(linearize(regression, base.values, base.solution.per_run))
    except (ResultError, ArithmeticError):
        return None
    projected = Projection(system, strategy.model.base_unknowns)
    floor = _floor(strategy, projected, system, parts)
    gains, rivals = _gains(strategy, projected, parts, floor)
    search = PartSearch(strategy, regression, strategy.model.base_unknowns, base.solution, parts, gains, rivals, floor)
    if not strategy.model.setup.linearized:
        return search
    # The noise was estimated again with the parts in the model: fits are comparable only under the same noise.
    start = search.fitted_baseline()
    return None if start is None else replace(search, start=start)


def _gains(
    strategy: Strategy, projected: Projection, parts: Sequence[Part], floor: float
) -> tuple[tuple[tuple[tuple[Part, ...], FunctionEvidence], ...], dict[str, FunctionEvidence]]:
    """The evidence of every set of parts, the largest first, and of every candidate."""
    gains = []
    for some in _sets(parts):
        information, score = projected.information([n for p in some for n in p.unknowns])
        found = best_evidence(information / floor, score / floor, some[0].orders, some[0].size, len(some))
        gains.append((some, found))
    rivals = {}
    for name, effect in strategy.model.setup.candidates.items():
        information, score = projected.information(strategy.model.amplitudes(name))
        every = [effect.unknowns[n] for n in amplitudes_of(effect)]
        ranges = np.array([max(abs(q.lower), abs(q.upper)) for q in every])
        rivals[name] = function_evidence(information / floor, score / floor, (POLICY.catalog_prior * ranges) ** 2)
    return tuple(sorted(gains, key=lambda pair: -pair[1].gain)), rivals


def _floor(strategy: Strategy, projected: Projection, system: LinearizedSystem, parts: Sequence[Part]) -> float:
    """Residual variance of a row with all parts and candidates fitted, at least one."""
    names = [n for p in parts for n in p.unknowns]
    names += [n for e in strategy.model.setup.candidates for n in strategy.model.amplitudes(e)]
    q = orthonormal(projected.orthogonal(system.columns_of(names)))
    rest = projected.y - q @ (q.T @ projected.y)
    rows = float(system.counts[system.run >= 0].sum())
    degrees = max(rows - q.shape[1] - projected.basis.shape[1], 1.0)
    return float(max(1.0, float(rest @ rest) / degrees))


def _sets(parts: Sequence[Part]) -> list[tuple[Part, ...]]:
    """Each part alone, and all places of one element together."""
    elements: dict[tuple[str, str], list[Part]] = {}
    for part in parts:
        elements.setdefault((part.group, part.coordinate), []).append(part)
    return [*((p,) for p in parts), *(tuple(places) for places in elements.values() if len(places) > 1)]


def _regression(strategy: Strategy, problem: SimulatedProblem) -> Regression:
    """The step's regression with every candidate and every part, with the noise model of the strategy's regression."""
    setup, parts = strategy.model.setup, problem.parts
    extra = [u for e in setup.effects for u in unknowns_of(e, prior=True)]
    extra += [Unknown(n, 0.0, unit=p.unit, prior=(0.0, p.size)) for p in parts for n in p.unknowns]
    effects = (*setup.effects, *(p.effect for p in parts))
    regression = problem.regression_like(strategy.model.regression, AddedEffects(effects, tuple(extra)), {})
    amplitudes = {n for e in setup.effects for n in amplitudes_of(e)} | {n for p in parts for n in p.unknowns}
    regression = without_priors(regression, amplitudes)
    return linearized(regression) if setup.linearized else regression
