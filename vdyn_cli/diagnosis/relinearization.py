"""Linearizations about an effect's own amplitude, for models that are too expensive to simulate at every step."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.effect_unknowns import amplitudes_of, started_at, unknowns_of
from vdyn_cli.diagnosis.full_model import LEAST_STEP, FittedModel
from vdyn_cli.diagnosis.linearized_system import linearize, linearized_system
from vdyn_cli.inference import Regression, Unknown, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import ResultError


@dataclass
class Relinearization:
    """Fits of the baseline with a few effects alone in the model, linearized about given amplitudes.

    Parameters
    ----------
    base : names of the baseline's shared unknowns.
    likely : amplitudes and gains that the step found for nondifferentiable effects; None where it found none.
    """

    setup: DiagnosisSetup
    base: tuple[str, ...]
    likely: dict[str, tuple[float, float] | None] = field(default_factory=dict)
    _fits: dict[tuple[str, ...], FittedModel] = field(default_factory=dict)
    _last: dict[tuple[tuple[str, ...], tuple[tuple[str, float], ...]], Regression] = field(default_factory=dict)

    def of(self, fitted: FittedModel) -> FittedModel:
        """The fit, linearized about its own amplitudes; unchanged where that fails.

        A nondifferentiable effect alone is linearized about its likely amplitude: a fit elsewhere tells none.
        """
        effects = fitted.effects
        if effects and effects not in self._fits:
            sharp = self.nondifferentiable(effects)
            if sharp and len(effects) == 1:
                return self.about_likely(effects[0]) or fitted
            try:
                self._fits[effects] = (self._twice if sharp else self._once)(effects, fitted.values)
            except (ResultError, ArithmeticError):
                self._fits[effects] = fitted
        return self._fits[effects] if effects else fitted

    def keep(self, fitted: FittedModel) -> None:
        """Use this fit for its effects."""
        self._fits[fitted.effects] = fitted

    def about_likely(self, effect: str) -> FittedModel | None:
        """The fit linearized about the effect's likely amplitude, alone in the model; None where it fails."""
        likely = self.likely_size(effect)
        if likely is None:
            return None
        if (effect,) not in self._fits:
            first = amplitudes_of(self.setup.candidates[effect])[0]
            try:
                self._fits[(effect,)] = self._twice((effect,), {first: likely[0]})
            except (ResultError, ArithmeticError):
                return None
        return self._fits[(effect,)]

    def nondifferentiable(self, effects: Sequence[str]) -> bool:
        """Whether any of them has a likely amplitude instead of a slope at zero."""
        known = self.setup.candidates
        return self.setup.likely_size is not None and any(known[e].probes for e in effects if e in known)

    def likely_size(self, name: str) -> tuple[float, float] | None:
        """The effect's likely amplitude and its gain in log likelihood; None where nothing can be simulated."""
        effect = self.setup.candidates[name]
        if name not in self.likely and self.setup.likely_size is not None:

            def start(amplitude: float) -> tuple[Unknown, ...]:
                return tuple(started_at(u, {amplitudes_of(effect)[0]: amplitude}) for u in unknowns_of(effect))

            try:
                self.likely[name] = self.setup.likely_size(effect, start)
            except (ResultError, ArithmeticError):
                self.likely[name] = None
        return self.likely.get(name)

    def alone(self, effects: tuple[str, ...], about: Mapping[str, float]) -> Regression:
        """The step's regression with these effects alone in the model, started at these values; the last is kept."""
        key = effects, tuple(about.items())
        if key not in self._last:
            every = [self.setup.candidates[e] for e in effects]
            extra = [started_at(u, about) for e in every for u in unknowns_of(e)]
            start = {n: v for n, v in about.items() if n in self.base}
            self._last = {key: self.setup.regression(every, extra, start=start)}
        return self._last[key]

    def _once(self, effects: tuple[str, ...], about: Mapping[str, float]) -> FittedModel:
        linear = linearized(self.alone(effects, about))
        solution = solve(linear, tolerance=LEAST_STEP)
        runs = linearize(linear, solution.values, solution.per_run)
        return FittedModel(effects, solution, runs, linearized_system(runs))

    def _twice(self, effects: tuple[str, ...], about: Mapping[str, float]) -> FittedModel:
        """Relinearized about what the first gave: nondifferentiable effects change the others' sensitivities."""
        return self._once(effects, self._once(effects, about).values)
