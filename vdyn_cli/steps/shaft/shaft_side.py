"""The half-shaft of one side: its logs, its drawing, its pendulum bar, and the fit to its logs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Solution, even_if_refused, white_level
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.fit_outcome import scatter
from vdyn_cli.steps.shaft.combined_regression import regression_with_effects
from vdyn_cli.steps.shaft.shaft_fit import ShaftFit, linear_solution
from vdyn_cli.steps.shaft.shaft_readings import UNREAD_TWIST, ShaftReadings
from vdyn_cli.steps.shaft.spec import SectionSpec, SideName
from vdyn_cli.steps.shaft.torque_clock import UNKNOWN
from vdyn_cli.steps.step_policy import STEP_POLICY

UNIT = "N m/rad"
IN_SERIES = "beside_drawing"  # tag of the effects in series with the bar
EXACT = 1e-3  # least relative standard deviation of a drawing's stiffness


@dataclass(frozen=True)
class LoggedShaft:
    """The fit to the logs of one half-shaft.

    Parameters
    ----------
    runs : the readings.
    twist, rate, torque : for each run, adjusted twist (n,) rad and rate (n,) rad/s, and the law's torque (n,) N m.
    solution : of the fit.
    stiffness, damping, correlation : N m/rad, N m s/rad, and the correlation of their errors.
    amplitudes : of the effects in the law, by unknown.
    """

    runs: tuple[ShaftReadings, ...]
    twist: tuple[Array, ...]
    rate: tuple[Array, ...]
    torque: tuple[Array, ...]
    solution: Solution
    stiffness: Budget
    damping: Budget
    correlation: float
    amplitudes: Mapping[str, Given]


@dataclass(frozen=True)
class ShaftSide:
    """The data of one side's half-shaft.

    Parameters
    ----------
    runs : readings of its logs.
    sections : of its drawing. drawing, bar : stiffness, N m/rad, by drawing and by pendulum bar, or None.
    torque_gain : standard deviation of the gain of the torque sensor.
    torque_delay : s, delay of the logged torque; the readings are corrected for its value.
    shifted : the same readings with the delay one standard deviation smaller and larger, at most ``UNKNOWN``; empty
        where it is exact.
    delay_assumed : whether nothing is stated about the delay.
    relaxation : s, of a viscoelastic shaft; twist and rate of ``runs`` are then filtered with this time constant.
    """

    name: SideName
    runs: tuple[ShaftReadings, ...]
    sections: tuple[SectionSpec, ...]
    drawing: Budget | None
    bar: Budget | None
    torque_gain: float
    torque_delay: Given
    shifted: tuple[tuple[ShaftReadings, ...], ...] = ()
    delay_assumed: bool = False
    relaxation: float = 0.0

    @cached_property
    def linear(self) -> Solution:
        """The fit to the logs without effects."""
        return linear_solution(self.runs)

    @cached_property
    def rate_noise(self) -> tuple[float, ...]:
        """Standard deviation of the adjusted rate of each run, rad/s; without a logged twist, of the readings.

        Without a twist, only the torque would improve the rates, by the damping that is to be tested.

        Raises
        ------
        ResultError : the fit without effects fails.
        """
        fit = self._fit(NO_EFFECTS)
        at = fit.unknowns_at(even_if_refused(lambda: self.linear))
        rates = (fit.adjusted(k, fit.regression.local(at, k))[1] for k in range(len(self.runs)))
        return tuple(
            white_level(rate, run.time) if run.noise[1] < UNREAD_TWIST else run.noise[2]
            for run, rate in zip(self.runs, rates, strict=True)
        )

    def drawn_bar(self, effects: Sequence[Effect]) -> tuple[float, float] | None:
        """Prior (mean, std) of the bar's stiffness from the drawing, N m/rad, if an effect in series is in the law.

        None if the log is stiffer than the drawing: no effect in series explains that, and other effects would be
        fitted to the difference.
        """
        if self.drawing is None or not any(IN_SERIES in effect.tags for effect in effects):
            return None
        drawn = self.drawing.value, max(self.drawing.std, EXACT * self.drawing.value)
        log = even_if_refused(lambda: self.linear)
        stiffness = self._budget(log, "shaft_stiffness", UNIT, log.std["shaft_stiffness"])
        apart = (stiffness.value - drawn[0]) / float(np.hypot(stiffness.std, drawn[1]))
        return None if apart > STEP_POLICY.agreeing_std else drawn

    def regression(self, added: AddedEffects) -> Regression:
        """The regression over the logs of this side, rows in standard deviations, with effects in the law.

        Raises
        ------
        ResultError : the fit without effects has no solution, not even a refused one.
        """
        fit = self._fit(added)
        return regression_with_effects(fit, even_if_refused(lambda: self.linear)) if added.effects else fit.regression

    def logged(self, added: AddedEffects) -> LoggedShaft:
        """Fit the logs of this side; an error of the torque's gain changes stiffness and damping by the same factor.

        A torque that is logged late by d reads k phi(t - d), to first order k phi - k d phi': the damping is too small
        by k d. Where the shaft oscillates, the second order k d^2 phi'' / 2 - c d phi'' changes the stiffness, too: by
        as much as the fits to the shifted torque differ.

        Stiffness and damping are those of the shaft with its joints. With an effect in series, they come from the fit
        without it: the log contains only the stiffness of both, and the drawing only divides it.

        Raises
        ------
        ResultError : the logs do not determine a stiffness.
        """
        found, in_series = self._logged(added), [e for e in added.effects if IN_SERIES in e.tags]
        if not in_series:
            return found
        both = self._logged(added.without(in_series))
        return replace(found, stiffness=both.stiffness, damping=both.damping, correlation=both.correlation)

    def _logged(self, added: AddedEffects) -> LoggedShaft:
        fit = self._fit(added)
        solution, covariance = fit.solve(self.linear)
        published, covariance = self._in_slow_oscillations(solution, covariance)
        std = np.sqrt(np.diag(covariance)).tolist()
        stiffness = self._budget(published, "shaft_stiffness", UNIT, std[0])
        damping = self._budget(published, "shaft_damping", "N m s/rad", std[1])
        late = Contribution("delay_of_the_torque", self.torque_delay.value, self.torque_delay.std, "s", stiffness.value)
        damping = replace(damping, contributions=(*damping.contributions, late))
        stiffness = replace(stiffness, contributions=(*stiffness.contributions, *self._stiffness_by_delay))
        if stiffness.interval95[0] <= 0:
            got = f"{stiffness.value:.4g} +- {stiffness.std:.2g} {UNIT}"
            what, remedy = "the log does not determine it", "log a tip-in with more torque"
            raise ResultError(Finding("shaft_stiffness", what, got, remedy))
        together = covariance[0, 1] + stiffness.value * damping.value * self.torque_gain**2
        at = fit.unknowns_at(solution)
        adjusted = [fit.adjusted(k, fit.regression.local(at, k)) for k in range(len(self.runs))]
        twist, rate, torque = zip(*adjusted, strict=True)
        # The standard deviation is at least that by the noise, even if the blocks scatter less.
        least = solution.classical_std
        amplitudes = {
            u.name: Given(solution.values[u.name], max(size, least[u.name]))
            for u, size in zip(added.unknowns, std[2:], strict=True)
        }
        correlation = float(together / (stiffness.std * damping.std))
        return LoggedShaft(self.runs, twist, rate, torque, solution, stiffness, damping, correlation, amplitudes)

    def _in_slow_oscillations(self, solution: Solution, covariance: Array) -> tuple[Solution, Array]:
        """The solution with the damping c - k t of slow oscillations, t the relaxation time, and its covariance."""
        if not self.relaxation:
            return solution, covariance
        into = np.eye(len(covariance))
        into[1, 0] = -self.relaxation
        k, c = solution.values["shaft_stiffness"], solution.values["shaft_damping"]
        slow = {**solution.values, "shaft_damping": c - self.relaxation * k}
        return replace(solution, values=slow), into @ covariance @ into.T

    @cached_property
    def _stiffness_by_delay(self) -> tuple[Contribution, ...]:
        """The change of the stiffness by one standard deviation of the torque's delay, without effects in the law."""
        if not self.shifted:
            return ()
        here, *there = (
            even_if_refused(partial(linear_solution, runs)).values["shaft_stiffness"]
            for runs in (self.runs, *self.shifted)
        )
        within = min(self.torque_delay.std, UNKNOWN)
        slope = max(abs(other - here) for other in there) / within
        return (Contribution("delay_of_the_torque", self.torque_delay.value, within, "s", slope),)

    def _fit(self, added: AddedEffects) -> ShaftFit:
        return ShaftFit(self.runs, added, self.drawn_bar(added.effects))

    def _budget(self, solution: Solution, name: str, unit: str, std: float) -> Budget:
        value, of_data = solution.values[name], replace(scatter(solution, name, unit), std=std)
        return Budget(value, (of_data, Contribution("torque_gain", 1.0, self.torque_gain, "", value)))
