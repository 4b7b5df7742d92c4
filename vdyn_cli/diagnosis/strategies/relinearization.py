"""Fits relinearized about the effects' own amplitudes, for models too expensive to simulate at every step."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.strategies.effect_unknowns import (
    amplitudes_of,
    bounds_of,
    coarse_starts,
    is_scale,
    started_at,
    stepped,
    unknowns_of,
)
from vdyn_cli.diagnosis.strategies.full_model import LEAST_STEP, FittedModel
from vdyn_cli.diagnosis.strategies.linearized_system import (
    LinearizedRuns,
    LinearizedSystem,
    initial_values,
    linearize,
    linearized_system,
)
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Unknown, solve
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.added_effects import AddedEffects

HELD = 1e-6  # of its prior standard deviation, with which an unknown counts as held
Stop = Callable[[FittedModel, FittedModel], bool]


@dataclass
class Relinearization:
    """Fits of the baseline with only a few effects in the model, linearized about given amplitudes.

    Parameters
    ----------
    base : names of the baseline's shared unknowns.
    """

    setup: DiagnosisSetup
    base: tuple[str, ...]
    _likely: dict[str, tuple[float, float] | None] = field(default_factory=dict)
    _fits: dict[tuple[str, ...], FittedModel] = field(default_factory=dict)
    _last: dict[tuple[object, ...], Regression] = field(default_factory=dict)
    _predictions: dict[tuple[object, ...], tuple[LinearizedRuns, LinearizedSystem]] = field(default_factory=dict)

    def of(self, fitted: FittedModel) -> FittedModel:
        """The fit, relinearized about its own amplitudes; unchanged where that fails.

        A single nondifferentiable effect is linearized about its likely amplitude, since a fit elsewhere gives none.
        """
        if not fitted.effects:
            return fitted
        if self.nondifferentiable(fitted.effects) and len(fitted.effects) == 1:
            return self.about_likely(fitted.effects[0]) or fitted
        return self.from_values(fitted.effects, fitted.values) or fitted

    def from_values(
        self, effects: tuple[str, ...], values: Mapping[str, float], stop: Stop | None = None
    ) -> FittedModel | None:
        """The fit with only these effects, relinearized from these values until it settles; None where it fails.

        Parameters
        ----------
        stop : (fit, previous fit) -> whether to return this fit although it has not settled.
        """
        if effects not in self._fits:
            try:
                if self.nondifferentiable(effects):  # it changes other sensitivities: linearized once about its result
                    fit, settled = self._once(effects, self._once(effects, values).values), True
                else:
                    fit, settled = self._until_settled(effects, values, stop)
            except (ResultError, ArithmeticError):
                return None
            if not settled:
                return fit
            self._fits[effects] = fit
        return self._fits[effects]

    def coarse_start(self, effect: str, linear: Mapping[str, float]) -> tuple[float, dict[str, float]] | None:
        """The least rms error of the main channel over a grid of a candidate's amplitude, and that amplitude.

        Parameters
        ----------
        linear : its amplitudes by a linear fit, which are tried, too.

        Returns
        -------
        None for candidates with several amplitudes, and where no simulation succeeds.
        """
        one, every = self.setup.candidates[effect], self.setup.effects
        first, *others = amplitudes_of(one)
        if others or self.setup.coarse_error is None:
            return None
        grid = coarse_starts(one)
        tried = [*grid, stepped(one, first, 0.0, linear[first])] if first in linear else grid
        unknowns = [u for e in every for u in unknowns_of(e)]
        best: tuple[float, dict[str, float]] | None = None
        for size in tried:
            try:
                # All candidates are in the model, the others at zero: one model is compiled for all of them.
                error = self.setup.coarse_error(
                    AddedEffects(every, tuple(started_at(u, {first: size}) for u in unknowns))
                )
            except (ResultError, ArithmeticError):
                continue
            if best is None or error < best[0]:
                best = error, {first: size}
        return best

    def about_likely(self, effect: str) -> FittedModel | None:
        """The fit with only this effect, linearized about its likely amplitude; None where it fails."""
        likely, first = self.likely_size(effect), amplitudes_of(self.setup.candidates[effect])[0]
        return None if likely is None else self.from_values((effect,), {first: likely[0]})

    def nondifferentiable(self, effects: Sequence[str]) -> bool:
        """Whether any of these effects has no slope at zero, so that its likely amplitude is used instead."""
        known = self.setup.candidates
        return self.setup.likely_size is not None and any(known[e].probes for e in effects if e in known)

    def likely_size(self, name: str) -> tuple[float, float] | None:
        """The effect's likely amplitude and its gain in log likelihood; None where no simulation succeeds."""
        effect = self.setup.candidates[name]
        if name not in self._likely and self.setup.likely_size is not None:

            def start(amplitude: float) -> tuple[Unknown, ...]:
                return tuple(started_at(u, {amplitudes_of(effect)[0]: amplitude}) for u in unknowns_of(effect))

            try:
                self._likely[name] = self.setup.likely_size(effect, start)
            except (ResultError, ArithmeticError):
                self._likely[name] = None
        return self._likely.get(name)

    def alone(self, effects: tuple[str, ...], about: Mapping[str, float], chord: bool) -> Regression:
        """The step's regression with only these effects, started at these values; the last one is cached.

        ``chord``: sensitivities to the baseline's unknowns may be those without the effects.
        """
        key = effects, tuple(about.items()), chord
        if key not in self._last:
            every = [self.setup.candidates[e] for e in effects]
            added = AddedEffects(tuple(every), tuple(started_at(u, about) for e in every for u in unknowns_of(e)))
            start = {n: v for n, v in about.items() if n in self.base}
            regression = self.setup.chord_regression if chord else self.setup.regression
            self._last = {key: _without_covered(regression(added, start=start), every)}
        return self._last[key]

    def predicted(
        self, effects: tuple[str, ...], about: Mapping[str, float], point: Mapping[str, float]
    ) -> tuple[LinearizedRuns, LinearizedSystem] | None:
        """The runs simulated at ``point`` with these effects, weighted by the noise ``about`` a fit's values.

        None where the model has no finite value.
        """
        key = effects, *(tuple(sorted(values.items())) for values in (about, point))
        if key not in self._predictions:
            try:
                alone = self.alone(effects, about, chord=True)
                runs = linearize(alone, point, initial_values(alone))
            except (ResultError, ArithmeticError):
                return None
            self._predictions[key] = runs, linearized_system(runs)
        return self._predictions[key]

    def _until_settled(
        self, effects: tuple[str, ...], about: Mapping[str, float], stop: Stop | None
    ) -> tuple[FittedModel, bool]:
        """The fit relinearized about its own amplitudes until they move by less than ``settled_std``.

        Returns
        -------
        The fit, and whether it has settled; False where ``stop`` ended it.

        Raises
        ------
        ResultError : a simulation is not finite, or an amplitude ends at its bound.
        """
        known = self.setup.candidates
        owner = {n: known[e] for e in effects if e in known for n in amplitudes_of(known[e])}
        point = {**about, **{n: stepped(e, n, 0.0, about[n]) for n, e in owner.items() if n in about}}
        before: FittedModel | None = None
        chord = not self.setup.far_off  # far off, the sensitivities differ too much for a chord iteration
        for _ in range(POLICY.most_linearizations):
            fit = self._once(effects, point, chord)
            values, begun = fit.values, {n: point.get(n, 0.0) for n in owner}
            settled = fit.solution.move_from(begun) < POLICY.settled_std
            if settled:
                if not chord:
                    break
                chord = False
            elif any(_is_stuck(point.get(n), values[n], bounds_of(e, n)) for n, e in owner.items()):
                break
            judged = before or (fit if settled or _is_near(fit, begun) else None)
            if judged is not None and stop is not None and stop(fit, judged):
                return fit, False
            before = fit
            point = {**values, **{n: stepped(e, n, point.get(n, 0.0), values[n]) for n, e in owner.items()}}
        for n, e in owner.items():
            low, high = bounds_of(e, n)
            if not low < fit.values[n] < high:
                raise ResultError(Finding("fit", f"{n} leaves the possible range", f"{fit.values[n]:.3g}"))
        return fit, True

    def _once(self, effects: tuple[str, ...], about: Mapping[str, float], chord: bool = False) -> FittedModel:
        linear = with_unbounded_scales(linearized(self.alone(effects, about, chord)), self.setup)
        solution = solve(linear, tolerance=LEAST_STEP)
        runs = linearize(linear, solution.values, solution.per_run)
        return FittedModel(effects, solution, runs, linearized_system(runs))


def _is_near(fit: FittedModel, about: Mapping[str, float]) -> bool:
    """Whether the amplitudes of a fit are near those ``about`` which it is linearized."""
    return all(abs(fit.values[n] - v) <= POLICY.near_share * abs(fit.values[n]) for n, v in about.items())


def _without_covered(regression: Regression, effects: Sequence[Effect]) -> Regression:
    """The regression with the nuisance parameters that the effects replace held at their prior means."""
    covered = {n for e in effects for n in e.covers}
    return regression.changed(lambda u: replace(u, prior=(u.prior[0], HELD * u.prior[1])) if u.prior else u, covered)


def _is_stuck(at: float | None, to: float, bounds: tuple[float, float]) -> bool:
    """Whether an amplitude is linearized at a bound and its fit leaves the range: further rounds would not help."""
    return at in bounds and not bounds[0] < to < bounds[1]


def with_unbounded_scales(regression: Regression, setup: DiagnosisSetup) -> Regression:
    """A linearized regression with unbounded scales, since a linear fit may pass through impossible values of them."""
    free = {n for e in setup.effects for n in amplitudes_of(e) if is_scale(e, n)}
    return regression.changed(lambda u: replace(u, lower=-np.inf, upper=np.inf), free)
