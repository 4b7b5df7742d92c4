"""The problem of a tire test: sweeps with slip, averaged into bins, and the curve without effects."""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, even_if_refused, solve
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.tire_curve import BRAKING, DEPARTURE, SHAPE, SHIFTS, TIRE_CURVE
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.effect_estimates import is_law, unbounded, unknowns_of_profiles
from vdyn_cli.steps.failure import UnpublishedError, unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.tire import text
from vdyn_cli.steps.tire.binned_sweep import binned_sweep
from vdyn_cli.steps.tire.fitted_curve import FittedCurve, explains_more, fitted_curve, shape_held
from vdyn_cli.steps.tire.parts import tire_parts
from vdyn_cli.steps.tire.policy import TIRE_POLICY
from vdyn_cli.steps.tire.result import STIFFNESS, tire_result
from vdyn_cli.steps.tire.slip_sweeps import slip_sweeps
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.tire_regression import CAR_TIRES, FEW_TERMS, TireCurveProblem, departing

FREE_FORCE = 300.0  # N, plausible amplitude of a free profile: a tenth of the friction of a car's wheel
HELD = 1e-4  # relative standard deviation of a shape factor that is stated without one
FEWEST_TO_COMPARE = 3  # sweeps, to find one that contradicts the others


@dataclass(frozen=True)
class TireProblem(SimulatedProblem):
    """Slip sweeps of one tire.

    Parameters
    ----------
    logs : with slip, NaN for excluded samples.
    fit : the logs averaged into bins, with the stated priors, without effects.
    formula : the same without departure from the magic formula, where the curve of ``fit`` may depart; else None.
    likely : by effects, the fit with the likeliest one, where that without any is refused; shared with the free form.
    """

    logs: tuple[Log, ...]
    fit: TireCurveProblem
    formula: TireCurveProblem | None = None
    likely: dict[tuple[Effect, ...], Mapping[str, float]] = field(default_factory=dict, compare=False, repr=False)

    @property
    def model(self) -> Model:
        """The curve, with or without a speed."""
        return self.fit.model

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of force over slip, load, time since a sweep began, and returning slip."""
        slip = span_of([log["slip"] for log in self.logs], 0.01)
        load = span_of([log["force_z"] for log in self.logs], 10.0)
        longest = max(log.duration for log in self.logs)
        return (
            profile("force_over_slip", "tire", "slip", slip, FREE_FORCE, "N"),
            profile("force_over_load", "tire", "load", load, FREE_FORCE, "N"),
            profile("force_over_time", "tire", "elapsed", (0.0, longest), FREE_FORCE, "N"),
            profile("force_over_returning_slip", "tire", "returning", slip, FREE_FORCE, "N"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """Force over slip, its reading over load, friction over load and sliding speed."""
        return tire_parts(self.logs, self.model is TIRE_CURVE)

    @cached_property
    def with_free_form(self) -> TireProblem:
        """The same sweeps with a curve that may depart from the magic formula."""
        return self if self.formula else replace(self, fit=departing(self.fit, DEPARTURE), formula=self.fit)

    @cached_property
    def baseline(self) -> FittedCurve | ResultError:
        """The curve without effects, or why the sweeps do not determine one."""
        try:
            return fitted_curve(self.fit)
        except ResultError as error:
            return error

    @cached_property
    def _slope_curve(self) -> FittedCurve:
        return self.baseline if isinstance(self.baseline, FittedCurve) else shape_held(self.fit)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over all bins of all sweeps, with effects on the curve.

        Slips are projected onto the curve of the fit with all effects except profiles, also where that is refused, such
        as with an unknown at its bound; without a fit, onto the curve without effects.
        """
        base = self.baseline
        if isinstance(base, FittedCurve):
            prior, values = base.fit.prior, base.solution.values
        else:  # the diagnosis starts from the curve with the most likely effect, or a typical tire
            prior = {**CAR_TIRES, **self.fit.prior}
            laws = tuple(e for e in added.effects if is_law(e))
            if laws not in self.likely:
                every = replace(self.formula or self.fit, prior=prior, added=added)
                self.likely[laws] = _with_likely_effect(every, laws)
            values = self.likely[laws]
        fit = replace(self.fit, prior=prior, added=added)
        begin = {**fit.first_values, **values, **start}
        at: Mapping[str, float] = begin
        if added.unknowns:
            with suppress(ResultError):  # no fit: the slips stay on the curve without effects
                profiles = unknowns_of_profiles(added.effects)
                whole = restricted(replace(fit, added=unbounded(added)).regression(begin), profiles)
                at = {**profiles, **even_if_refused(partial(solve, whole)).values}
        return fit.regression(at, begin)

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """B C D, the slope of friction at zero slip."""
        at = values if set(SHAPE) <= set(values) else {**self._slope_curve.solution.values, **values}
        return {STIFFNESS: at["tire_B"] * at["tire_C"] * at["tire_D"]}

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit the curve, with accepted effects on it, and publish what the sweeps determine.

        Raises
        ------
        ResultError : the sweeps do not determine a curve; if all but one do, that sweep is named.
        """
        key = (added.effects, *((u.name, u.start) for u in added.unknowns))
        if key not in self._published:
            self._published[key] = self._fitted(added)
        return self._published[key]

    @cached_property
    def _published(self) -> dict[Hashable, Result]:
        """The results so far: a diagnosis requests that with its answer more than once."""
        return {}

    def _fitted(self, added: AddedEffects) -> Result:
        if self.formula is not None or added.effects:
            return self._shown(fitted_curve(replace(self.formula or self.fit, added=added)))

        def shown(end: Solution) -> Result:
            fit = replace(self.fit, prior={**CAR_TIRES, **self.fit.prior})
            return tire_result(FittedCurve(fit, end, None), self.fit.prior, self.logs)

        why = self.baseline.findings if isinstance(self.baseline, ResultError) else ()
        try:
            curve = self._slope_curve
            result = tire_result(curve, self.fit.prior, self.logs) if why else self._shown(curve)
        except ResultError as error:
            raise unpublished(error, shown, (*self._odd_sweep(), *why)) from None
        if curve.fit.scale > 1.0 and (odd := self._odd_sweep()):
            raise UnpublishedError((*odd, *why), result)
        return replace(result, findings=(*result.findings, *why))

    def _shown(self, formula: FittedCurve) -> Result:
        """The result of a fit of the magic formula, or of a free form that explains the sweeps significantly better.

        The free form is also taken where the sweeps end before the peak: the slope then depends on the curve's form. A
        warning says why it cannot be fitted, where the sweeps end before the peak or contradict the formula.
        """
        open_end = formula.peak is None and formula.fit.scale == 1.0
        prior, failed = (self.formula or self.fit).prior, ""
        try:
            forms = _free_forms(replace(formula.fit, prior=prior, scale=1.0, begin=formula.solution.values))
            curve = next(forms)
            if self.formula or open_end or explains_more(curve, formula, TIRE_POLICY.departs):
                return tire_result(curve, prior, self.logs, formula, next(forms, curve))
        except ResultError as error:
            if self.formula is not None:
                raise
            failed = error.findings[0].reason
        result = tire_result(formula, prior, self.logs)
        if not (failed and (open_end or result.fit.misfit)):
            return result
        return replace(result, fit=replace(result.fit, warnings=(*result.fit.warnings, text.no_free_form(failed))))

    def _odd_sweep(self) -> tuple[Finding, ...]:
        """A finding on the sweep without which the others determine a curve, if there is exactly one."""
        found, sweeps = [], self.fit.sweeps
        for odd in sweeps if len(sweeps) >= FEWEST_TO_COMPARE else ():
            try:
                others = tuple(sweep for sweep in sweeps if sweep is not odd)
                if fitted_curve(replace(self.fit, sweeps=others)).peak is not None:
                    found.append(odd.run)
            except ResultError:
                continue
        if len(found) != 1:
            return ()
        what = "contradicts the other sweeps, which are consistent without it"
        return (Finding(found[0], what, remedy="check for a wet or cold road, another load, or a failed channel"),)


def _with_likely_effect(fit: TireCurveProblem, effects: Sequence[Effect]) -> Mapping[str, float]:
    """The values of the fit with the one of these effects that explains most; empty where none can be fitted.

    An error that drives the curve without effects to its bounds, such as a relaxation length under fast pulses, is far
    from values to which a fit of all effects converges from a typical tire.
    """
    found: list[Solution] = []
    for effect in effects:
        alone = replace(fit, added=fit.added.without([e for e in fit.added.effects if e is not effect]))
        with suppress(ResultError):
            found.append(alone.minima()[0])
    return min(found, key=lambda s: s.cost).values if found else NO_VALUES


def _free_forms(bare: TireCurveProblem) -> Iterator[FittedCurve]:
    """Fits with few and with all terms of a departure from the magic formula; one that fails is left out.

    Of a fit that fails, such as with C at its bound under friction that hardly falls beyond its peak, C is held at its
    first value, which the departure can replace.

    Parameters
    ----------
    bare : the magic formula, with first values.

    Raises
    ------
    ResultError : all four fail.
    """
    failed: list[ResultError] = []
    first = {**bare.first_values, **(bare.begin or NO_VALUES)}["tire_C"]
    held = replace(bare, prior={"tire_C": (first, HELD), **bare.prior})
    for terms in (FEW_TERMS, DEPARTURE):
        for one in (bare, held):
            try:
                yield fitted_curve(departing(one, terms))
                break
            except ResultError as error:
                failed.append(error)
    if len(failed) == 4:
        raise failed[0]


def prepare(spec: TireSpec, logs: Sequence[Log], known: Parameters) -> TireProblem:
    """The problem of a tire test.

    Parameters
    ----------
    logs : as :func:`slip_sweeps`. known : wheel_radius (m), where slip is computed from speeds.

    Raises
    ------
    InputError : as :func:`slip_sweeps`.
    """
    sweeps = slip_sweeps(logs, spec.settings, known)
    radius = known.estimates.get("wheel_radius")
    radius_std = radius.std / radius.value if radius and "slip" not in logs[0] else 0.0
    settings = spec.settings
    free = (*(SHIFTS if settings.shifts else ()), *(BRAKING if settings.peaks == "two" else ()))
    fit = TireCurveProblem(
        tuple(binned_sweep(log) for log in sweeps),
        _priors(spec, known),
        radius_std,
        free=free,
        force_zero=settings.force_zero.value,
    )
    return TireProblem(sweeps, fit)


def _priors(spec: TireSpec, known: Parameters) -> dict[str, tuple[float, float]]:
    """Mean and standard deviation of each shape factor that the description states; an exact one is nearly fixed.

    Values of parameter files are not used as priors, because they may come from the same sweeps.
    """
    stated = {n: Given(e.value, e.std) for n, e in known.items() if n in SHAPE and e.source == "given"}
    stated |= {str(n): given for n, given in spec.settings.priors.items()}
    return {n: (g.value, g.std or HELD * max(abs(g.value), 1.0)) for n, g in stated.items()}
