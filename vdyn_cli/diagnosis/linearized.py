"""The strategy of models that are expensive to simulate: one linearization, repeated about large effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vdyn_cli.diagnosis.detection import Detection, detect
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.full_model import LEAST_STEP, NO_VALUES, FittedModel, FullModel, full_model
from vdyn_cli.diagnosis.linearized_system import initial_values, linearize, linearized_system
from vdyn_cli.diagnosis.nested_fits import NestedFits
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.relinearization import Relinearization
from vdyn_cli.diagnosis.strategy import Strategy
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import ResultError


@dataclass
class LinearizedStrategy:
    """Linear fits about one point. The error of a linearization grows with the square of the step from that point."""

    model: FullModel
    relinearization: Relinearization
    _fits: NestedFits = field(init=False)

    def __post_init__(self) -> None:
        self._fits = NestedFits(self.model)

    @property
    def prior_values(self) -> Mapping[str, float]:
        """The baseline's parameters as they are known beforehand."""
        base = set(self.model.base)
        return {u.name: u.prior[0] for u in self.model.regression.shared if u.prior and u.name in base}

    def fitted(self, effects: Sequence[str] = ()) -> FittedModel | None:
        """See Strategy."""
        return self._fits.fitted(effects)

    def relinearized(self, fitted: FittedModel) -> FittedModel:
        """See Strategy."""
        return self.relinearization.of(fitted)

    def rescanned(self, effects: Sequence[str]) -> FittedModel | None:
        """None: the sensitivities of one linearization are the same in all its fits."""
        return None

    def predicted(self, fitted: FittedModel, effects: Sequence[str], values: Mapping[str, float]) -> FittedModel | None:
        """See Strategy. Predictions can be compared only where the same noise weights them: that of ``fitted``."""
        if not fitted.effects:
            return None
        every = tuple(sorted({*fitted.effects, *effects}))
        zero = {n: 0.0 for e in every for n in self.model.amplitudes(e)}
        try:
            alone = self.relinearization.alone(every, fitted.values)
            runs = linearize(alone, {**zero, **values, **self.prior_values}, initial_values(alone))
        except (ResultError, ArithmeticError):
            return None
        return FittedModel(tuple(effects), fitted.solution, runs, linearized_system(runs))

    def secants(self, effects: Sequence[str]) -> Mapping[str, float]:
        """None: nondifferentiable effects are linearized about their likely amplitude."""
        return NO_VALUES

    def focused(self, found: Detection) -> tuple[LinearizedStrategy, Detection]:
        """The linearization about the effect that explains most, and what is detected there.

        The first linearization does not tell which candidates are worth a fit: of another tire relaxation it may give
        a tenth of the evidence that it gives of half-shaft damping, of which none is left about the relaxation.
        """
        strongest = strongest_relinearized(self, found)
        if strongest is None:
            return self, found
        near = self._about(strongest) if found.scores.evidence[strongest] > POLICY.large_t else self
        there = self.about_likely(strongest, near)
        base = there.fitted(())
        return (self, found) if there is self or base is None else (there, detect(there, base))

    def _about(self, effect: str) -> LinearizedStrategy:
        """Linearized about the effect's amplitude, until that settles.

        Effects that resemble each other give nearly the same simulation, so that none of them is favored.
        """
        near: LinearizedStrategy = self
        before: dict[str, float] = {}
        for _ in range(0 if self.relinearization.nondifferentiable((effect,)) else POLICY.linearizations):
            fitted = near.fitted((effect,))
            if fitted is None:
                break
            if near is self:
                fitted = self.relinearized(fitted)
            amplitudes = {n: fitted.values[n] for n in self.model.amplitudes(effect)}
            if before and _settled(fitted.solution, before):
                break
            again = self._opened({n: fitted.values[n] for n in self.model.base} | amplitudes)
            if again is None:
                break
            near, before = again, amplitudes
        return near

    def about_likely(self, effect: str, other: LinearizedStrategy) -> LinearizedStrategy:
        """Linearized about the likely amplitude of a nondifferentiable effect: ``effect``, or one that resembles it.

        ``other`` where there is none, or none that explains clearly more than ``effect`` does in ``other``.
        """
        of = self.relinearization
        alike = [e.name for e in self.model.setup.effects if effect in (e.name, *e.alike)]
        sharp = [name for name in alike if of.nondifferentiable((name,))]
        gains = {name: likely[1] for name in sharp if (likely := of.likely_size(name)) is not None}
        if not gains:
            return other
        best = max(gains, key=gains.__getitem__)
        base, fitted = self.fitted(()), other.fitted((effect,))
        if best != effect and base is not None and fitted is not None:
            least = min(fitted.solution.cost, other.relinearized(fitted).solution.cost)
            if gains[best] < base.solution.cost - least + POLICY.clearly_better:
                return other
        found = of.about_likely(best)
        if found is None:
            return other
        there = self._opened({n: found.values[n] for n in (*self.model.base, *self.model.amplitudes(best))})
        if there is None:
            return other
        there.relinearization.keep(found)
        return there

    def _opened(self, about: Mapping[str, float]) -> LinearizedStrategy | None:
        """The strategy linearized elsewhere; None where that, or the baseline's fit, fails."""
        try:
            there = open_linearized(self.model.setup, about)
            there.fitted(())
        except (ResultError, ArithmeticError):
            return None
        there.relinearization.likely = self.relinearization.likely
        return there


def strongest_relinearized(strategy: Strategy, found: Detection) -> str | None:
    """The candidate that explains most, large ones compared each on its own linearization; None where none is visible.

    On the baseline's linearization a wrong one may seem to explain several times more than the true one.
    """
    evidence = found.scores.evidence
    large = sorted((n for n in found.testable if evidence[n] > POLICY.large_t), key=lambda n: -evidence[n])
    large = large[: POLICY.most_relinearized]
    if len(large) < 2:
        return found.scores.strongest(found.testable)
    fits = {n: strategy.fitted((n,)) for n in large}
    costs = {n: strategy.relinearized(fit).solution.cost for n, fit in fits.items() if fit is not None}
    return min(costs, key=costs.__getitem__, default=found.scores.strongest(large))


def open_linearized(setup: DiagnosisSetup, about: Mapping[str, float] = NO_VALUES) -> LinearizedStrategy:
    """The linearized strategy of a setup.

    Parameters
    ----------
    about : amplitudes of effects, the others are zero, and values of the baseline's own unknowns; the baseline's fit
        where none are given.

    Raises
    ------
    ResultError : the baseline itself cannot be fitted.
    """
    point = about or _baseline_values(setup)

    def regression(effects: Sequence[Effect], unknowns: Sequence[Unknown]) -> Regression:
        added = {u.name for u in unknowns}
        own = {n: v for n, v in point.items() if n not in added}
        return linearized(setup.regression(effects, unknowns, start=own))

    model = full_model(setup, regression, point)
    return LinearizedStrategy(model, Relinearization(setup, model.base))


def _baseline_values(setup: DiagnosisSetup) -> Mapping[str, float]:
    """The baseline's linear fit, relinearized until it settles where a nondifferentiable effect is in the model."""
    values: Mapping[str, float] = NO_VALUES
    for _ in range(1 + POLICY.linearizations * setup.nondifferentiable):
        found = solve(linearized(setup.regression((), (), start=values)), tolerance=LEAST_STEP)
        settled = values and _settled(found, values)
        values = found.values
        if settled:
            break
    return values


def _settled(solution: Solution, before: Mapping[str, float]) -> bool:
    """Whether a fit moves these values by little of their standard deviations."""
    return all(abs(solution.values[n] - v) < POLICY.settled_std * solution.std[n] for n, v in before.items())
