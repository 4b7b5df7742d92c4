"""The strategy of models that are expensive to simulate: one linearization, repeated about large effects."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from vdyn_cli.diagnosis.candidate_models import candidate_model
from vdyn_cli.diagnosis.detection import Detection, detect
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.effect_unknowns import bounds_of, is_scale
from vdyn_cli.diagnosis.full_model import LEAST_STEP, FittedModel, FullModel, full_model, with_open_range
from vdyn_cli.diagnosis.held_out_gain import rms_of
from vdyn_cli.diagnosis.linearized_system import initial_values, linearize, linearized_system
from vdyn_cli.diagnosis.nested_fits import NestedFits
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.relinearization import Relinearization, Stop, relaxed
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.contract import NO_VALUES


def rms_alone(fit: FittedModel) -> float:
    """Root mean square error of the main channel with a fit, each run's own unknowns fitted."""
    return rms_of(fit.runs)


@dataclass
class LinearizedStrategy:
    """Linear fits about one point, whose error grows with the square of the step from that point."""

    model: FullModel
    relinearization: Relinearization
    _fits: NestedFits = field(init=False)
    _predictions: dict[object, FittedModel] = field(default_factory=dict, init=False)
    _refuted: tuple[str, ...] = field(default=(), init=False)  # candidates whose own exact fit is no answer

    def __post_init__(self) -> None:
        self._fits = NestedFits(self.model)

    @property
    def base(self) -> FittedModel:
        """See Strategy."""
        return self._fits.base

    @property
    def nonlinear(self) -> bool:
        """False: all fits of one linearization have the same sensitivities."""
        return False

    @property
    def prior_values(self) -> Mapping[str, float]:
        """The prior means of the baseline's parameters."""
        base = set(self.model.base)
        return {u.name: u.prior[0] for u in self.model.regression.shared if u.prior and u.name in base}

    def fitted(self, effects: Sequence[str]) -> FittedModel | None:
        """See Strategy. None also where a linear fit moves a scale out of its possible range."""
        made = self._fits.fitted(effects)
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
        key = every, tuple(effects), tuple(sorted(fitted.values.items())), tuple(sorted(point.items()))
        if key not in self._predictions:
            try:
                alone = self.relinearization.alone(every, fitted.values, chord=True)
                runs = linearize(alone, point, initial_values(alone))
            except (ResultError, ArithmeticError):
                return None
            self._predictions[key] = FittedModel(tuple(effects), fitted.solution, runs, linearized_system(runs))
        return self._predictions[key]

    def with_open_range(self) -> LinearizedStrategy:
        """See Strategy. The point of linearization stays; relinearized fits stay within the plausible range."""
        wide = LinearizedStrategy(with_open_range(self.model), self.relinearization)
        wide._fits.keep((), self.base)
        for name in self._refuted:
            wide._fits.keep((name,), None)
        return wide

    def secants(self, effects: Sequence[str]) -> Mapping[str, float]:
        """None: nondifferentiable effects are linearized about their likely amplitude."""
        return NO_VALUES

    def focused(self, found: Detection) -> tuple[LinearizedStrategy, Detection]:
        """The strategy linearized about the effect that explains most, and the detection repeated there.

        Evidence on the first linearization ranks large effects wrongly: with a wrong tire relaxation, half-shaft
        damping may show ten times the evidence of the relaxation, and none once linearized about the latter.
        """
        large = large_alone(self, found)
        strongest = best_of(large) or found.scores.strongest(found.testable)
        if strongest is None:
            return self, found
        is_large = self.model.setup.far_off or found.scores.evidence[strongest] > POLICY.large_t
        local = self._relinearized_about(strongest) if is_large else self
        there = self.about_likely(strongest, local)
        if there is self:
            return self, found
        seen = _with_likely(self.relinearization, found, detect(there, there.base))
        if there is local and (self.model.setup.far_off or any(self._is_far(n, fit) for n, fit in large.items())):
            self._refit_others(local, strongest, large)
            # About a large scale, ``reachable_t`` is wrong for the others: candidates with a fit stay testable.
            shown = {n for n, fit in large.items() if fit is not None}
            seen = replace(seen, testable=tuple(n for n in found.scores.names if n in shown or n in seen.testable))
        return there, seen

    def _is_far(self, name: str, alone: FittedModel | None) -> bool:
        """Whether the candidate's own amplitude differs from that of this linearization by more than chance."""
        linear = self.fitted((name,))
        if alone is None or linear is None:
            return True
        return any(
            abs(alone.values[n] - linear.values[n]) > POLICY.needed_t * alone.solution.std[n]
            for n in self.model.amplitudes(name)
        )

    def _refit_others(self, local: LinearizedStrategy, strongest: str, large: Mapping[str, FittedModel | None]) -> None:
        """Fit every other large candidate on its own linearization: that about ``strongest`` is too far away.

        Candidates whose best fit misses the main channel by far more than the best one does are dropped, and so are
        those that leave much of the misfit where ``strongest`` leaves almost none.
        """
        missed = {n: rms_alone(fit) for n, fit in large.items() if fit is not None}
        least = min(missed.values(), default=0.0)
        answer = candidate_model(local, (strongest,))
        answered = answer is not None and (answer.sufficient or answer.nearly_sufficient)
        best = large.get(strongest)
        for name, fit in large.items():
            if name == strongest or self.relinearization.nondifferentiable((name,)):
                continue
            kept, hopeless = None, answered and best is not None and self.is_hopeless(fit, best)
            if fit is not None and missed[name] < POLICY.far_worse * least and not hopeless:
                names = (*self.model.base, *self.model.amplitudes(name))
                there = self._linearized_at({n: fit.values[n] for n in names})
                kept = there.fitted((name,)) if there is not None else None
            local._fits.keep((name,), None if kept is None else _weighted_like(kept, local.model.regression))
            if fit is not None and kept is None:
                local._refuted += (name,)

    def is_hopeless(self, fit: FittedModel | None, best: FittedModel) -> bool:
        """Whether a candidate leaves so much of the misfit that the best one explains that it cannot be an answer."""
        base = self.fitted(())
        if fit is None or base is None or self.model.setup.far_off:
            return False
        least, noise = _own_cost(best), self.model.regression.log_noise
        explained = base.solution.cost + noise - least
        return _own_cost(fit) - least > max(POLICY.hopeless_share**2 * explained, POLICY.large_t**2)

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
            if fitted is None:
                break
            amplitudes = {n: fitted.values[n] for n in self.model.amplitudes(effect)}
            if before and _settled(fitted.solution, before):
                break
            again = self._linearized_at({n: fitted.values[n] for n in self.model.base} | amplitudes)
            if again is None:
                break
            local, before = again, amplitudes
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
        base, fitted = self.fitted(()), other.fitted((effect,))
        if best != effect and base is not None and fitted is not None:
            least = min(fitted.solution.cost, other.relinearized(fitted).solution.cost)
            if gains[best] < base.solution.cost - least + POLICY.clearly_better:
                return other
        found = near.about_likely(best)
        if found is None:
            return other
        there = self._linearized_at({n: found.values[n] for n in (*self.model.base, *self.model.amplitudes(best))})
        if there is None:
            return other
        there.relinearization.keep(found)
        return there

    def _linearized_at(self, about: Mapping[str, float]) -> LinearizedStrategy | None:
        """The strategy linearized at ``about``; None where the linearization or the baseline's fit fails."""
        try:
            there = open_linearized(self.model.setup, about)
            there.fitted(())
        except (ResultError, ArithmeticError):
            return None
        there.relinearization = self.relinearization  # its fits do not depend on the point
        return there


def _with_likely(relinearization: Relinearization, found: Detection, seen: Detection) -> Detection:
    """``seen`` with the nondifferentiable effects testable that were so in ``found``, which used their amplitudes."""
    kept = {n for n in found.testable if relinearization.nondifferentiable((n,))}
    testable = tuple(n for n in found.scores.names if n in kept or n in seen.testable)
    return replace(seen, testable=testable)


def large_alone(strategy: LinearizedStrategy, found: Detection) -> dict[str, FittedModel | None]:
    """The strongest large candidates, each fitted alone on its own linearization; None where that fails.

    On the baseline's linearization, a wrong candidate may seem to explain several times more than the true one, and the
    true one may exceed its range: its fit then starts from the one-step estimate of the score test.
    """
    if strategy.model.setup.far_off:
        return _far_alone(strategy, found)
    evidence = found.scores.evidence
    names = sorted((n for n in found.testable if evidence[n] > POLICY.large_t), key=lambda n: -evidence[n])
    fits: dict[str, FittedModel | None] = {}
    for name in names[: POLICY.most_relinearized]:
        linear = strategy.fitted((name,))
        if strategy.relinearization.nondifferentiable((name,)):  # the first linearization is invalid for it
            fits[name] = strategy.relinearization.about_likely(name) or linear
            continue
        step = found.scores.estimate[name].tolist() if linear is None else ()
        start = linear.values if linear else dict(zip(strategy.model.amplitudes(name), step, strict=True))
        fits[name] = strategy.relinearization.from_values((name,), start, _stop_beside(fits, strategy))
    return fits


def _far_alone(strategy: LinearizedStrategy, found: Detection) -> dict[str, FittedModel | None]:
    """Candidates fitted alone from the best of coarse starts: scores mean little where the baseline is far off."""
    relinearization, starts = strategy.relinearization, {}
    for name in found.testable:
        linear = dict(zip(strategy.model.amplitudes(name), found.scores.estimate[name].tolist(), strict=True))
        if (start := relinearization.coarse_start(name, linear)) is not None:
            starts[name] = start
    nearest = sorted(starts, key=lambda n: starts[n][0])[: POLICY.most_relinearized]
    assert strategy.model.setup.coarse_error is not None
    baseline = strategy.model.setup.coarse_error((), ())
    fits: dict[str, FittedModel | None] = {}
    for name in nearest:
        best = _best_fit(fits)
        fits_already = best is not None and POLICY.far_worse * rms_alone(best) < baseline
        if fits_already and starts[name][0] > POLICY.coarse_gain * baseline:
            continue
        fits[name] = relinearization.from_values((name,), starts[name][1], _stop_beside(fits, strategy))
    return fits


def _stop_beside(fits: Mapping[str, FittedModel | None], strategy: LinearizedStrategy) -> Stop:
    """The criterion by which a relinearized fit ends early: it cannot reach the best of ``fits``.

    It leaves much of what the best one explains, or misses the main channel by far more, twice in succession.
    """

    def stop(fit: FittedModel, before: FittedModel) -> bool:
        best = _best_fit(fits)
        if best is None:
            return False
        far = POLICY.far_worse * rms_alone(best)
        now, last = rms_alone(fit), rms_alone(before)
        return (now > far and last > far and now > last / POLICY.far_worse) or strategy.is_hopeless(fit, best)

    return stop


def _best_fit(fits: Mapping[str, FittedModel | None]) -> FittedModel | None:
    best = best_of(fits)
    return fits[best] if best else None


def best_of(fits: Mapping[str, FittedModel | None], missed: Callable[[FittedModel], float] = rms_alone) -> str | None:
    """The candidate with the largest likelihood; None where none can be fitted.

    Each fit has its own noise estimate, which contains what the candidate leaves unexplained, so that only candidates
    with about the same error of the main channel are compared.

    Parameters
    ----------
    missed : rms error of the main channel with a fit.
    """
    made = {n: fit for n, fit in fits.items() if fit is not None}
    error = {n: missed(fit) for n, fit in made.items()}
    least = min(error.values(), default=0.0)
    near = [n for n in made if error[n] <= POLICY.far_worse * least]
    return min(near, key=lambda n: _own_cost(made[n]), default=None)


def _own_cost(fit: FittedModel) -> float:
    """Negative log likelihood with the fit's own noise."""
    return fit.solution.cost + fit.runs.regression.log_noise


def _weighted_like(fit: FittedModel, other: Regression) -> FittedModel:
    """The fit with its cost comparable to costs of a regression with another noise."""
    cost = fit.solution.cost + fit.runs.regression.log_noise - other.log_noise
    return replace(fit, solution=replace(fit.solution, cost=cost))


def _leaves_range(setup: DiagnosisSetup, fitted: FittedModel) -> bool:
    effects = [setup.candidates[e] for e in fitted.effects if e in setup.candidates]
    bounds = {n: bounds_of(e, n) for e in effects for n in e.unknowns if is_scale(e, n)}
    return any(not low < fitted.values[n] < high for n, (low, high) in bounds.items())


def open_linearized(setup: DiagnosisSetup, about: Mapping[str, float] = NO_VALUES) -> LinearizedStrategy:
    """The linearized strategy of a setup.

    Parameters
    ----------
    about : point of linearization: amplitudes of effects (the others are zero) and values of the baseline's own
        unknowns. Without it, the baseline's fit.

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
    model = replace(model, regression=relaxed(model.regression, setup))
    return LinearizedStrategy(model, Relinearization(setup, model.base))


def _baseline_values(setup: DiagnosisSetup) -> Mapping[str, float]:
    """The baseline's linear fit, relinearized until it settles if the model has a nondifferentiable effect."""
    values: Mapping[str, float] = NO_VALUES
    for _ in range(1 + POLICY.linearizations * setup.nondifferentiable):
        found = solve(linearized(setup.regression((), (), start=values)), tolerance=LEAST_STEP, unconverged=True)
        settled = values and _settled(found, values)
        values = found.values
        if settled:
            break
    return values


def _settled(solution: Solution, before: Mapping[str, float]) -> bool:
    """Whether a fit moves these values by a small share of their standard deviations."""
    return all(abs(solution.values[n] - v) < POLICY.settled_std * solution.std[n] for n, v in before.items())
