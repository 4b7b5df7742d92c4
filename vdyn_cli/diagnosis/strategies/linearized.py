"""The strategy of models that are expensive to simulate: one linearization, repeated about large effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from math import inf

from vdyn_cli.diagnosis.detect.detection import Detection, detect
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.gain.held_out_gain import rms_of
from vdyn_cli.diagnosis.name.candidate_models import candidate_model
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import bounds_of, is_scale
from vdyn_cli.diagnosis.strategies.fits_alone import FitsAlone, best_of, fits_alone, is_hopeless, largest_error
from vdyn_cli.diagnosis.strategies.full_model import LEAST_STEP, FittedModel, FullModel, full_model, with_open_range
from vdyn_cli.diagnosis.strategies.nested_fits import NestedFits
from vdyn_cli.diagnosis.strategies.relinearization import Relinearization, with_unbounded_scales
from vdyn_cli.inference import Regression, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.contract import NO_VALUES


@dataclass(frozen=True)
class LinearizedStrategy(NestedFits):
    """Linear fits about one point, whose error grows with the square of the step from that point.

    Parameters
    ----------
    relinearization : the fits about other points, which strategies of one setup share.
    refuted : candidates without a fit, since their fit on their own linearization is no answer.
    """

    relinearization: Relinearization = field(kw_only=True)
    refuted: frozenset[str] = frozenset()

    @cached_property
    def _made(self) -> dict[tuple[str, ...], FittedModel | None]:
        return {**self.known, **{(n,): None for n in self.refuted}}

    @property
    def nonlinear(self) -> bool:
        """False: all fits of one linearization have the same sensitivities."""
        return False

    @property
    def prior_values(self) -> Mapping[str, float]:
        """The prior means of the baseline's parameters."""
        base = set(self.model.base_unknowns)
        return {u.name: u.prior[0] for u in self.model.regression.shared if u.prior and u.name in base}

    def fitted(self, effects: Sequence[str], below: float = inf) -> FittedModel | None:
        """See Strategy. None also where a linear fit moves a scale out of its possible range; none ends early."""
        made = super().fitted(effects)
        return None if made is None or _leaves_range(self.model.setup, made) else made

    def relinearized(self, fitted: FittedModel) -> FittedModel:
        """See Strategy."""
        return self.relinearization.of(fitted)

    def predicted(self, fitted: FittedModel, effects: Sequence[str], values: Mapping[str, float]) -> FittedModel | None:
        """See Strategy. Predictions are comparable only if the same noise weights them: that of ``fitted``."""
        if not fitted.effects:
            return None
        every = tuple(sorted({*fitted.effects, *effects}))
        zero = {n: 0.0 for e in every for n in self.model.amplitudes(e)}
        point = {**zero, **values, **self.prior_values}
        simulated = self.relinearization.predicted(every, fitted.values, point)
        return FittedModel(tuple(effects), fitted.solution, *simulated) if simulated else None

    def with_open_range(self, about: str = "") -> LinearizedStrategy:
        """See Strategy. Relinearized fits stay within the plausible range."""
        wide = replace(self, model=with_open_range(self.model), known={(): self.base})
        fitted = wide.fitted((about,)) if about and self.model.setup.far_off else None
        there = self._linearized_about(fitted) if fitted else None
        return there.with_open_range() if there else wide

    def about(self, fitted: FittedModel) -> LinearizedStrategy:
        """See Strategy. Unchanged where the fit, relinearized, moves by less than chance, or has none there."""
        exact = self.relinearized(fitted)
        there = self._linearized_about(exact) if self._is_far(fitted.effects, fitted, exact) else None
        return there if there and there.fitted(fitted.effects) else self

    def about_largest_effect(self, found: Detection) -> tuple[LinearizedStrategy, Detection]:
        """The strategy linearized about the effect that explains most, and the detection repeated there.

        Evidence on the first linearization ranks large effects wrongly (``fits_alone``).
        """
        alone = fits_alone(self, found)
        strongest = best_of(alone) or found.scores.strongest(found.testable)
        if strongest is None:
            return self, found
        is_large = self.model.setup.far_off or found.scores.evidence[strongest] > POLICY.large_t
        local = self._relinearized_about(strongest) if is_large else self
        if is_large and not self.model.setup.far_off and (better := local.best_with_shape(found, strongest)):
            strongest, local = better, self._relinearized_about(better)
        there = self.about_likely(strongest, local)
        if there is self:
            return self, found
        # Nondifferentiable effects were tested in ``found`` at their likely amplitudes; ``there`` they may not show.
        kept = {n for n in found.testable if self.relinearization.nondifferentiable((n,))}
        repeated = detect(there, there.base)
        far = any(self._is_far((n,), self.fitted((n,)), fit) for n, fit in alone.items())
        if there is local and (far or self.model.setup.far_off):
            there = self._with_own_fits(local, strongest, alone)
            # About a large scale, ``reachable_t`` is wrong for the others: candidates with a fit stay testable.
            kept |= {n for n, fit in alone.items() if fit is not None}
        testable = tuple(n for n in found.scores.names if n in kept or n in repeated.testable)
        return there, replace(repeated, testable=testable)

    def best_with_shape(self, found: Detection, strongest: str) -> str | None:
        """The effect with a shape parameter that explains clearly more than the strongest one; None without any.

        Away from its own amplitude its shape is nominal, so that it may be the true effect and yet not suffice.
        """
        shaped = [n for n in found.testable if len(self.model.freed(n)) > len(self.model.amplitudes(n))]
        made = {n: f.solution.cost for n in (*shaped, strongest) if (f := self.fitted((n,))) is not None}
        if strongest not in made or len(made) == 1:
            return None
        best = min(made, key=made.__getitem__)
        return best if made[best] < made[strongest] - POLICY.clearly_better else None

    def _is_far(self, effects: Sequence[str], linear: FittedModel | None, exact: FittedModel | None) -> bool:
        """Whether the amplitudes of a relinearized fit differ from those of a linear one by more than chance."""
        if exact is None or linear is None:
            return True
        return any(
            abs(exact.values[n] - linear.values[n]) > POLICY.needed_t * exact.solution.std[n]
            for e in effects
            for n in self.model.amplitudes(e)
        )

    def _with_own_fits(self, local: LinearizedStrategy, strongest: str, alone: FitsAlone) -> LinearizedStrategy:
        """Every other large candidate fitted on its own linearization: ``local``, about ``strongest``, is too far away.

        No answer, and left without a fit, are candidates whose best fit misses the main channel by far more than the
        best one does, and those that leave much of the misfit where ``strongest`` leaves almost none.
        """
        made = {n: fit for n, fit in alone.items() if fit is not None}
        largest = largest_error(min(made.values(), key=lambda fit: rms_of(fit.runs))) if made else 0.0
        answer = candidate_model(local, (strongest,))
        almost_all = answer is not None and (answer.sufficient or answer.nearly_sufficient)
        best = made.get(strongest) if almost_all else None
        known: dict[tuple[str, ...], FittedModel | None] = {n: local.fitted(n) for n in ((), (strongest,))}
        refuted = set[str]()
        for name in alone:
            if name == strongest or self.relinearization.nondifferentiable((name,)):
                continue
            fit, own = made.get(name), None
            if fit and rms_of(fit.runs) < largest and not (best and is_hopeless(self, fit, best)):
                there = self._linearized_about(fit)
                own = there.fitted((name,)) if there else None
            known[(name,)] = _weighted_like(own, local.model.regression) if own else None
            if fit and not own:
                refuted.add(name)
        return replace(local, known=known, refuted=frozenset(refuted))

    def _relinearized_about(self, effect: str) -> LinearizedStrategy:
        """The strategy relinearized about the effect's amplitude until that settles.

        Effects that resemble each other give nearly the same simulation there, so that none of them is favored.
        """
        local: LinearizedStrategy = self
        before: dict[str, float] = {}
        for _ in range(0 if self.relinearization.nondifferentiable((effect,)) else POLICY.linearizations):
            fitted = local.fitted((effect,))
            if local is self:
                fitted = self.relinearization.from_values((effect,), fitted.values if fitted else NO_VALUES) or fitted
            if fitted is None or (before and fitted.solution.move_from(before) < POLICY.settled_std):
                break
            again = self._linearized_about(fitted)
            if again is None:
                break
            local, before = again, {n: fitted.values[n] for n in self.model.amplitudes(effect)}
        return local

    def about_likely(self, effect: str, other: LinearizedStrategy) -> LinearizedStrategy:
        """The strategy linearized about the likely amplitude of a nondifferentiable effect: ``effect`` or one like it.

        Returns ``other`` if there is none, or none that explains clearly more than ``effect`` does in ``other``.
        """
        near = self.relinearization
        similar = [e.name for e in self.model.setup.effects if effect in (e.name, *e.alike)]
        tried = [name for name in similar if near.nondifferentiable((name,))]
        gains = {name: likely[1] for name in tried if (likely := near.likely_size(name)) is not None}
        if not gains:
            return other
        best = max(gains, key=gains.__getitem__)
        fitted = other.fitted((effect,))
        if best != effect and fitted is not None:
            least = min(fitted.solution.cost, other.relinearized(fitted).solution.cost)
            if gains[best] < self.base.solution.cost - least + POLICY.clearly_better:
                return other
        found = near.about_likely(best)
        return (self._linearized_about(found) if found else None) or other

    def _linearized_about(self, fit: FittedModel) -> LinearizedStrategy | None:
        """The strategy linearized at a fit's values; None where the linearization or the baseline's fit fails."""
        names = self.model.fitted_unknowns(fit.effects)
        try:
            model = _linearized_model(self.model.setup, {n: fit.values[n] for n in names if n in fit.values})
            there = LinearizedStrategy(model, relinearization=self.relinearization)
            there.fitted(())
        except (ResultError, ArithmeticError):
            return None
        return there


def _weighted_like(fit: FittedModel, other: Regression) -> FittedModel:
    """The fit with its cost comparable to costs of a regression with another noise."""
    cost = fit.solution.cost + fit.runs.regression.log_noise - other.log_noise
    return replace(fit, solution=replace(fit.solution, cost=cost))


def _leaves_range(setup: DiagnosisSetup, fitted: FittedModel) -> bool:
    effects = [setup.candidates[e] for e in fitted.effects if e in setup.candidates]
    bounds = {n: bounds_of(e, n) for e in effects for n in e.unknowns if is_scale(e, n)}
    return any(not low < fitted.values[n] < high for n, (low, high) in bounds.items())


def open_linearized(setup: DiagnosisSetup) -> LinearizedStrategy:
    """The linearized strategy of a setup, about the baseline's fit.

    Raises
    ------
    ResultError : the baseline itself cannot be fitted.
    """
    model = _linearized_model(setup, _baseline_values(setup))
    return LinearizedStrategy(model, relinearization=Relinearization(setup, model.base_unknowns))


def _linearized_model(setup: DiagnosisSetup, point: Mapping[str, float]) -> FullModel:
    """The full model linearized about values of the baseline's unknowns and amplitudes of effects; unlisted: zero."""

    def regression(added: AddedEffects) -> Regression:
        names = set(added.names)
        own = {n: v for n, v in point.items() if n not in names}
        return linearized(setup.regression(added, start=own))

    model = full_model(setup, regression, point)
    return replace(model, regression=with_unbounded_scales(model.regression, setup))


def _baseline_values(setup: DiagnosisSetup) -> Mapping[str, float]:
    """The baseline's linear fit, relinearized until it settles if the model has a nondifferentiable effect."""
    values: Mapping[str, float] = NO_VALUES
    for _ in range(1 + POLICY.linearizations * setup.nondifferentiable):
        found = solve(linearized(setup.regression(start=values)), tolerance=LEAST_STEP, unconverged=True)
        settled = values and found.move_from(values) < POLICY.settled_std
        values = found.values
        if settled:
            break
    return values
