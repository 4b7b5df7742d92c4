"""The problem of a load-transfer test: its runs cut into windows, the balance, and the fit without effects."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import RefusedFitError, Regression, Solution, even_if_refused, solve
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.load_transfer import SLIP
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.cg.balance_rows import BalanceRows
from vdyn_cli.steps.cg.carried_weight import carried_weight
from vdyn_cli.steps.cg.input_checks import gentle_doubts, ready_runs, weight_contradiction
from vdyn_cli.steps.cg.known_vehicle import COMPLIANCE, KnownVehicle, known_vehicle, with_free_heave
from vdyn_cli.steps.cg.load_fit import EXACT, LoadFit
from vdyn_cli.steps.cg.load_windows import cut_windows, with_smaller_loads
from vdyn_cli.steps.cg.logged_speed import gps_zero, other_accelerometer, speed_change
from vdyn_cli.steps.cg.parts import balance_parts
from vdyn_cli.steps.cg.policy import CG_POLICY
from vdyn_cli.steps.cg.result import cg_result
from vdyn_cli.steps.cg.run_clocks import run_clocks
from vdyn_cli.steps.cg.spec import CgSpec
from vdyn_cli.steps.cg.unmeasured_heave import NO_HEAVE
from vdyn_cli.steps.contract import NO_VALUES, SimulatedProblem
from vdyn_cli.steps.effect_estimates import is_law, unbounded, unknowns_of_profiles
from vdyn_cli.steps.failure import unpublished
from vdyn_cli.steps.free_part import Part
from vdyn_cli.steps.free_profiles import profile, span_of

FREE_MOMENT = 500.0  # N m, plausible amplitude of a free profile: a tenth of the moment of braking at 6 m/s^2
NOISE_ROUNDS = 2  # of a fit that determines noise and true channels, which only serve the linearization
TOLERANCE = 1e-2  # of one residual's variance that a further step of that fit may gain
MOST_ITERATIONS = 100  # of that fit in a round: one that has not converged then is not used
SPEED_INTEGRATED = Finding(
    "cg",
    "speed is not logged; it is the integral of the acceleration, zero at its minimum",
    "",
    "map 'speed' if logged: it also shows a tilt or a zero offset of the accelerometer",
    minor=True,
)


@dataclass(frozen=True)
class CgProblem(SimulatedProblem):
    """Accelerate-and-brake runs of one car.

    Parameters
    ----------
    logs : of the runs, as read. fit : without effects.
    findings : about the description and the logs.
    """

    logs: tuple[Log, ...]
    vehicle: KnownVehicle
    fit: LoadFit
    findings: tuple[Finding, ...]
    _fits_with_one: dict[tuple[str, ...], tuple[Solution, float] | None] = field(
        default_factory=dict, init=False, repr=False, compare=False
    )

    @property
    def model(self) -> Model:
        """The moment balance that these logs allow."""
        return self.fit.model

    @property
    def profiles(self) -> tuple[Effect, ...]:
        """Free profiles of moment over the acceleration and over the pitch rate."""
        push = span_of([log["acceleration"] for log in self.logs], 1.0)
        rates = [log["pitch_rate"] for log in self.logs if "pitch_rate" in log] or [np.array([-0.1, 0.1])]
        return (
            profile("moment_over_acceleration", "motion_moment", "acceleration", push, FREE_MOMENT, "N m"),
            profile("moment_over_pitch_rate", "motion_moment", "pitch_rate", span_of(rates, 0.02), FREE_MOMENT, "N m"),
        )

    @property
    def parts(self) -> tuple[Part, ...]:
        """The moment over acceleration and pitch rate, load readings over their value."""
        return balance_parts(self.logs)

    @cached_property
    def baseline(self) -> Solution:
        """The fit without effects; raises ResultError as ``publish``."""
        return self.fit.solve()

    @cached_property
    def _first(self) -> Solution:
        """The first fit without effects, even where it was refused."""
        return even_if_refused(lambda: self.fit.first_solution)

    def regression(self, added: AddedEffects = NO_EFFECTS, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The regression over all windows of all runs, with effects in the balance.

        Noise and true channels are those of the fit with all effects, where the runs determine it (with priors on
        the unknowns of ``added`` they always do), else those at the start. It starts at the fit without effects.
        """
        if not added.unknowns:
            here = even_if_refused(lambda: self.baseline)
            return self.fit.regression(self.fit.unknowns_at(here), self.fit.unknowns_at(here, start))
        fit = replace(self.fit, added=added)
        return fit.regression(self._linearization_point(fit), fit.unknowns_at(self._first, start))

    def regression_like(self, known: Regression, added: AddedEffects, start: Mapping[str, float]) -> Regression:
        """The regression with noise and true channels of ``known``, if its residuals are hardly more than noise.

        Otherwise they are recomputed, because channels that fulfill a wrong balance would hide its further errors.
        """
        rows = known.rows
        assert isinstance(rows, BalanceRows)
        if rows.misfit >= CG_POLICY.balance_noise:
            return self.regression(added, start)
        fit = replace(self.fit, added=added)
        return fit.regression(rows.unknowns_in(fit), fit.unknowns_at(self._first, start), rows.heave)

    def _linearization_point(self, fit: LoadFit) -> Array:
        """The unknowns at which noise and true channels are computed: the fit with all effects of ``fit``.

        Where a large effect is present, the noise and channels of the baseline hide it, and all effects together, free
        profiles among them, can imitate it. So if one effect alone leaves only noise, the fit with that one is used,
        and if the fit with all effects fails or does not follow the loads, the best fit with one. Without rear loads
        the heave's noise is estimated from residuals; then one effect that leaves as little as all of them is used.
        """
        alone: tuple[Array, float] | None = None
        heaves = not self.fit.both_axles
        if not heaves and _misfit(self._first) >= CG_POLICY.balance_misfit:
            alone = self._best_with_one(fit)
            if alone[1] < CG_POLICY.balance_noise:
                return alone[0]
        whole = replace(fit, added=unbounded(fit.added))
        found = self._nearly_fitted(whole, unknowns_of_profiles(fit.added.effects))
        at, misfit = (fit.unknowns_at(found[0]), found[1]) if found else (fit.unknowns_at(self._first), np.inf)
        enough = CG_POLICY.balance_noise * misfit if heaves else CG_POLICY.balance_misfit
        if (_unexplained(self.fit, even_if_refused(lambda: self.baseline)) if heaves else misfit) < enough:
            return at
        if heaves:
            alone = self._best_with_one(fit)
            return alone[0] if alone[1] < enough else at
        alone = alone or self._best_with_one(fit)
        return alone[0] if alone[1] < misfit else at

    def _best_with_one(self, fit: LoadFit) -> tuple[Array, float]:
        """Unknowns and misfit of the best fit with one effect of ``fit``; without effects where none converges."""
        at, misfit = fit.unknowns_at(self._first), np.inf
        own = {profile.name for profile in self.profiles}
        for effect in (e for e in fit.added.effects if e.name not in own):
            unknowns = tuple(u for u in fit.added.unknowns if u.name in effect.unknowns)
            if is_law(effect):  # a free function needs its prior
                unknowns = tuple(replace(u, prior=None) for u in unknowns)
            alone = AddedEffects((effect,), unknowns)
            key = effect.name, *alone.names
            if key not in self._fits_with_one:
                self._fits_with_one[key] = self._nearly_fitted(replace(self.fit, added=alone))
            found = self._fits_with_one[key]
            if found is not None and found[1] < misfit:
                at, misfit = fit.unknowns_at(found[0]), found[1]
        return at, misfit

    def _nearly_fitted(self, fit: LoadFit, held: Mapping[str, float] = NO_VALUES) -> tuple[Solution, float] | None:
        """A fit with effects in a few rounds, for noise and true channels, and its misfit; None where it fails.

        It starts at the fit without effects; unknowns in ``held`` keep these values.
        """
        try:
            solution = self._first
            for _ in range(NOISE_ROUNDS):
                balance = restricted(fit.regression(fit.unknowns_at(solution)), held)
                solution = solve(balance, tolerance=TOLERANCE, most_iterations=MOST_ITERATIONS)
            return solution, _unexplained(fit, solution)
        except ResultError:
            return None

    def derived(self, values: Mapping[str, float]) -> Mapping[str, float]:
        """The distance from the center of gravity to the front axle."""
        known = values if "cg_to_rear" in values else even_if_refused(lambda: self.baseline).values
        return {"cg_to_front": self.vehicle.values["wheelbase"] - known["cg_to_rear"]}

    def publish(self, added: AddedEffects = NO_EFFECTS) -> Result:
        """Fit height, position and pitch inertia to all runs at once, with accepted effects in the balance.

        Raises
        ------
        ResultError : the runs do not determine the unknowns, or the fit does not converge.
        """
        if added.unknowns and self.fit.pitch_inertia is not None:  # with the effects, the runs may determine it
            with suppress(ResultError):
                return replace(self, fit=replace(self.fit, pitch_inertia=None)).publish(added)
        fit = replace(self.fit, added=added) if added.unknowns else self.fit
        try:
            fit, solution = self._with_effects(fit) if added.unknowns else (fit, self.baseline)
            return cg_result(fit, solution, self.vehicle, self.findings)
        except RefusedFitError as error:
            exact = replace(self.vehicle, std={})
            raise unpublished(error, lambda solution: cg_result(fit, solution, exact, self.findings)) from None

    def _with_effects(self, fit: LoadFit) -> tuple[LoadFit, Solution]:
        """The fit with its effects, and its solution.

        Tires that the fit without effects holds at usual values are free, if they are plausible beside the effects.
        """
        tires = {n: self.vehicle.nuisances[n] for n in (*SLIP, COMPLIANCE) if n in fit.nuisances}
        free = replace(fit, nuisances={**fit.nuisances, **tires})
        if free.nuisances != fit.nuisances and (near := self._nearly_fitted(free)):
            with suppress(ResultError):
                solution = free.solve(near[0])
                if not _implausible_tires(free, solution):
                    return free, solution
        near = self._nearly_fitted(fit)
        return fit, fit.solve(near[0] if near else None)


def _misfit(solution: Solution) -> float:
    """Sum of squares of the whitened residuals per row: 1 where only noise is left."""
    return 2.0 * solution.cost / sum(r.size for r in solution.residuals)


def _unexplained(fit: LoadFit, solution: Solution) -> float:
    """Mean square of the balances whitened by the sensors' noise alone, without the heave by the road."""
    if fit.both_axles:
        return _misfit(solution)
    rows = fit.regression(fit.unknowns_at(solution), heave=NO_HEAVE).rows
    assert isinstance(rows, BalanceRows)
    return rows.misfit


def prepare(spec: CgSpec, logs: Sequence[Log], known: Parameters) -> CgProblem:
    """The problem of a load-transfer test.

    Parameters
    ----------
    known : mass, wheelbase and antenna_height at least, SI.

    Raises
    ------
    InputError : known numbers or logs that cannot be used, with every reason.
    """
    vehicle = known_vehicle(spec, known)
    load_zero = spec.settings.load_zero.value
    headings = [run.heading for run in spec.runs] or [0.0] * len(logs)
    ready = ready_runs(spec, logs)
    share, contradiction = weight_contradiction(logs, vehicle, load_zero)
    if share:
        ready = tuple(with_smaller_loads(log, share) for log in ready)
    vehicle = replace(vehicle, load_excess=share)
    if not all("rear_load" in log for log in ready):
        vehicle = with_free_heave(vehicle)
    runs = tuple(cut_windows(log, way) for log, way in zip(ready, headings, strict=True))
    speeds = tuple(speed_change(log) for log in ready)
    carried = tuple(carried_weight(log, vehicle.values["mass"]) for log in ready)
    findings = [*vehicle.findings, *contradiction, *gentle_doubts(ready).values()]
    findings += other_accelerometer(ready, spec.settings.accelerometer)
    findings += gps_zero(logs) if spec.settings.accelerometer == "gps" else []
    findings += [SPEED_INTEGRATED] if not all("speed" in log for log in ready) else []
    findings += [f for log in logs for f in log.findings]
    fit = _with_plausible_tires(
        LoadFit(runs, vehicle.values, load_zero, vehicle.nuisances, run_clocks(logs), speeds=speeds, carried=carried)
    )
    return _holding_inertia(CgProblem(tuple(logs), vehicle, fit, tuple(findings)))


def _with_plausible_tires(fit: LoadFit) -> LoadFit:
    """The fit with the tires' slip or compliance held at usual values, if it is estimated outside of plausible ones.

    It then imitates another error of the balance, such as a clock offset, and hides it. A relaxation length alone is
    not judged: the runs show little of it, and held, it leaves a rest beside a small clock offset. The first solution
    has the true channels of a usual car, so that what is implausible there is judged by the converged fit.
    """
    doubtful = _implausible_tires(fit, even_if_refused(lambda: fit.first_solution))
    if doubtful:
        doubtful = _implausible_tires(fit, even_if_refused(fit.solve))
    if not doubtful:
        return fit
    held = {n for first in doubtful for n in (SLIP if first == SLIP[0] else (first,))}
    return replace(
        fit, nuisances={n: (m, EXACT * m) if n in held else (m, std) for n, (m, std) in fit.nuisances.items()}
    )


def _implausible_tires(fit: LoadFit, found: Solution) -> list[str]:
    """The tires' properties whose estimates are not those of a tire."""
    judged = {n: fit.nuisances[n] for n in (SLIP[0], COMPLIANCE) if n in fit.nuisances}
    limit = CG_POLICY.cg_implausible
    return [n for n, (mean, std) in judged.items() if abs(found.values.get(n, mean) - mean) >= limit * std]


def _holding_inertia(problem: CgProblem) -> CgProblem:
    """The problem with the pitch inertia held, if the fit is refused while it is free and accepted while it is held.

    It is held at the value of the refused fit, at most two standard deviations from a typical one. Not where the fit
    does not describe the loads: an effect such as a clock offset drove the inertia to its bound, and beside a wrong one
    that is held no candidate explains them.
    """
    try:
        _accepted, end = problem.baseline, None
    except RefusedFitError as error:
        end = error.solution()
    except ResultError:
        end = None
    if end is None:
        return problem
    typical, std = problem.vehicle.typical_pitch_inertia, problem.vehicle.pitch_inertia_std
    held = float(np.clip(end.values["pitch_inertia"], typical - 2 * std, typical + 2 * std))
    other = replace(problem, fit=replace(problem.fit, pitch_inertia=held))
    with suppress(ResultError):
        return other if _misfit(other.baseline) < CG_POLICY.balance_misfit else problem
    return problem
