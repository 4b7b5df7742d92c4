"""The moment balance fitted with noise in every channel, and without differentiating the pitch rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial
from operator import attrgetter

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import RefusedFitError, Regression, Solution, Unknown, solve
from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.regression import stacked
from vdyn_cli.physics.models.load_transfer import (
    CARRIED,
    EXCESS_GAIN,
    FRONT_LOAD_TRANSFER,
    HEAVE_LEVERS,
    HEAVES,
    LOAD_TRANSFER,
    MOMENTS,
    SLIP,
    SOUGHT,
    SPEED_RATE,
    UNIT,
)
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.cg.balance_rows import BalanceInputs, BalanceRows, WhitenedRun, narrowed, simulated
from vdyn_cli.steps.cg.carried_weight import CarriedWeight
from vdyn_cli.steps.cg.driven_channels import NO_RESPONSES, driven_channels, driven_responses, without_driven
from vdyn_cli.steps.cg.known_vehicle import HEAVE_STD
from vdyn_cli.steps.cg.load_windows import WINDOW, LoadWindows
from vdyn_cli.steps.cg.local_derivative import SPAN, TRUE_SPAN, local_derivative
from vdyn_cli.steps.cg.logged_speed import SpeedChange
from vdyn_cli.steps.cg.noise import NoisyBalance, noisy_balance, true_channels
from vdyn_cli.steps.cg.policy import CG_POLICY
from vdyn_cli.steps.cg.uneven_road import uneven_road
from vdyn_cli.steps.cg.unmeasured_heave import NO_HEAVE, heave_autocovariance, with_heave
from vdyn_cli.steps.contract import NO_VALUES

MOST_ROUNDS = 14  # of the fit: the change shrinks in each, so a fit that needs more does not converge
HEAVE_ROUNDS = 5  # of the fit, with the heave's noise from the last residuals; then the noise is held
SETTLED = 1e-3  # standard deviations by which an unknown may change in the last round
SLOW = 0.02  # likewise, of a fit that still changes after all rounds: at a tenth less a round, 0.2 remain in all
EXACT = 1e-4  # relative standard deviation of a value that is held
USUAL_HEIGHT = 0.55  # m, of the center of gravity, at which a fit starts
TOLERANCE = 1e-8  # of one residual's variance that a further step of a fit may gain
ROUGH_TOLERANCE = 1e-2  # likewise, in a round after which the unknowns still change
INEXACT = 0.03  # share of the last round's change, in standard deviations, by which a round may miss its minimum


@dataclass(frozen=True)
class LoadFit:
    """Runs with axle loads, and the center of gravity and pitch inertia estimated from them.

    The balance is integrated over each window, so that the pitch acceleration enters as the change of the measured
    pitch rate: nothing is differentiated. Noise in loads, acceleration and pitch rate all enters the balance; the
    unknown true channels are eliminated (total least squares), because a fit that attributes all noise to the loads
    biases the pitch inertia low.

    Parameters
    ----------
    known : parameters that are not estimated, by name, SI.
    nuisances : mean and standard deviation of uncertain properties of the vehicle (``KnownVehicle``).
    speeds : for each run, the speed as a second reading of the acceleration; None where it is not logged throughout.
    carried : for each run, the load of both axles; None where that or the speed is not logged.
    load_zero : standard deviation of the zero of one wheel's load, N.
    pitch_inertia : kg m^2, held at this value where the runs do not determine it.
    clocks : the delay of each run's loggers relative to each other, where it is estimated (``run_clocks``).
    added : corrections of the balance.
    """

    runs: tuple[LoadWindows, ...]
    known: Mapping[str, float]
    load_zero: float
    nuisances: Mapping[str, tuple[float, float]]
    clocks: AddedEffects = NO_EFFECTS
    added: AddedEffects = NO_EFFECTS
    speeds: tuple[SpeedChange | None, ...] = ()
    carried: tuple[CarriedWeight | None, ...] = ()
    pitch_inertia: float | None = None

    @property
    def model(self) -> Model:
        """The moment balance that these loads allow."""
        return LOAD_TRANSFER if self.both_axles else FRONT_LOAD_TRANSFER

    @cached_property
    def unknowns(self) -> tuple[Unknown, ...]:
        """The three of ``SOUGHT``, started at a typical car's, levers of an unmeasured heave, those of the effects, and
        each run's load zeros."""
        start = {
            "cg_height": USUAL_HEIGHT,
            "cg_to_rear": self.known["wheelbase"] / 2,
            "pitch_inertia": 1.3 * self.known["mass"],
        }
        held = self.pitch_inertia
        priors = {} if held is None else {"pitch_inertia": (held, EXACT * held)}
        std = self.load_zero * 2**0.5  # two wheels an axle
        zeros = [f"{n}_zero" for n in self.runs[0].loads] if std > 0 else []
        excess = (0.0, CG_POLICY.axle_gain)
        gain = [Unknown(EXCESS_GAIN, 0.0, prior=excess, nuisance=True, physical=_plausible(excess))]
        spins = self.known["spin"] > 0
        usual = {n: p for n, p in self.nuisances.items() if spins or n not in SLIP}
        return (
            *(Unknown(n, start[n], PARAMETERS[n].lower, PARAMETERS[n].upper, prior=priors.get(n)) for n in SOUGHT),
            *(Unknown(n, 0.0, prior=(0.0, HEAVE_STD), nuisance=True) for n in HEAVE_LEVERS if n in self.known),
            *(Unknown(n, p[0], prior=p, nuisance=True, physical=_plausible(p)) for n, p in usual.items()),
            *(gain if any(self.carried) else ()),
            *self.added.unknowns,
            *(Unknown(n, 0.0, prior=(0.0, std), per_run=True, nuisance=True) for n in zeros),
            *self.clocks.unknowns,
        )

    @property
    def effects(self) -> tuple[Effect, ...]:
        """Of the loggers' clocks, and those that are added."""
        return *self.clocks.effects, *self.added.effects

    @property
    def both_axles(self) -> bool:
        """Whether the loads of both axles are logged."""
        return "rear_load" in self.runs[0].loads

    @cached_property
    def simulators(self) -> tuple[Simulator, Simulator, Simulator]:
        """The balance with the unknowns and, for the noise, the zeros of all channels, each with the outputs needed.

        In this order: all moments and the true load per newton read; the moments that a pitch acceleration changes;
        the corrected acceleration, and the load of both axles where both are logged.
        """
        loads = self.runs[0].loads
        zeros = [f"{n}_zero" for n in _entering(loads)]
        values = {**self.known, **{n: 0.0 for n in zeros}, **{u.name: u.start for u in self.unknowns[: len(SOUGHT)]}}
        names = tuple(dict.fromkeys([*(u.name for u in self.unknowns), *zeros]))

        def of(*outputs: str) -> Simulator:
            return Simulator(replace(self.model, outputs=outputs), values, names, self.effects)

        if self.both_axles:
            return of(*MOMENTS, UNIT), of(*MOMENTS[:2]), of(SPEED_RATE, CARRIED)
        return of(*MOMENTS, UNIT), of(*MOMENTS[:2]), of(SPEED_RATE)

    @cached_property
    def measured(self) -> tuple[BalanceInputs, ...]:
        """The measured channels of each run."""
        return tuple(_balance_inputs(w, w.channels, SPAN, _lever(self)) for w in self.runs)

    @cached_property
    def first_solution(self) -> Solution:
        """The fit with true channels at the start values; raises ResultError as ``solve``.

        Its noise is that of the sensors, and with both axles' loads that of an uneven road.
        """
        own = [u.start for u in self.unknowns if u.per_run]
        start = np.array([*(u.start for u in self.unknowns if not u.per_run), *own * len(self.runs)])
        first = solve(self.regression(start, heave=NO_HEAVE), tolerance=TOLERANCE)
        if not self.both_axles:
            return first
        at = self.unknowns_at(first)
        road = self.heave_noise(at)
        return solve(self.regression(at, heave=road), tolerance=TOLERANCE) if road.size else first

    def solve(self, near: Solution | None = None) -> Solution:
        """Fit, with noise and true channels recomputed until the unknowns converge.

        Parameters
        ----------
        near : a solution for the same unknowns at which the fit starts; None: the first solution.

        Raises
        ------
        ResultError : the unknowns are not determined, or do not converge.
        """

        first = near or self.first_solution
        heave = self.heave_noise(self.unknowns_at(first)) if self.both_axles else NO_HEAVE
        for _ in range(0 if self.both_axles else HEAVE_ROUNDS):
            heave = self.heave_noise(self.unknowns_at(first))
            first = solve(self.regression(self.unknowns_at(first), heave=heave), tolerance=TOLERANCE)

        def refit(state: tuple[Solution, float]) -> tuple[tuple[Solution, float], float]:
            solution, before = state
            at = self.unknowns_at(solution)
            tolerance = float(np.clip((INEXACT * before) ** 2, TOLERANCE, ROUGH_TOLERANCE))
            later = solve(self.regression(at, heave=heave), tolerance=tolerance)
            shared = len(later.names)
            moved = float(np.max(np.abs(self.unknowns_at(later) - at)[:shared] / np.array(list(later.std.values()))))
            return (later, moved), moved if tolerance == TOLERANCE else np.inf

        settled = until_settled(refit, (first, np.inf), MOST_ROUNDS - 1, SETTLED)
        last, moved = settled.state
        if not settled.converged and moved > SLOW:
            what = f"the fit of the moment balance does not converge in {MOST_ROUNDS} iterations"
            got = f"last step {moved:.2g} standard deviations"
            finding = Finding("fit", what, got, "check units and signs of accelerometer and loads")
            raise RefusedFitError([finding], self.regression(self.unknowns_at(last)), lambda: last)
        return last

    def unknowns_at(self, solution: Solution, start: Mapping[str, float] = NO_VALUES) -> Array:
        """All unknowns (s + g m), SI, at a solution of this fit or of one without effects.

        The s shared ones are first, then the m own ones of each of the g runs. Shared unknowns that the solution lacks
        have their start value.

        Parameters
        ----------
        start : values of shared unknowns that replace those of the solution.
        """
        return stacked(self.unknowns, {**solution.values, **start}, solution.per_run)

    def regression(self, at: Array, start: Array | None = None, heave: Array | None = None) -> Regression:
        """The regression over all runs, with noise and true channels computed ``at`` these unknowns (s + g m).

        It starts at ``start``, else at ``at``. ``heave`` is the heave's autocovariance, else that of ``heave_noise``.

        r(theta) = L^-1 (g(theta_0; measured) + g(theta; true) - g(theta_0; true)),   J = dr/dtheta

        g the integrated balances, theta_0 = ``at``, L L' the covariance of g there. The true channels and what follows
        linearly from them, such as derivatives, are uncorrelated with the balances of the measured ones (hence no
        bias), and smoothed, because their noise only adds scatter.
        """
        noisy = self._noisy_balances(at)
        noise = _heave_of(self, noisy, at) if heave is None else heave
        lever = self.known["antenna_height"] - float(at[0])  # the height comes first
        driven = driven_responses(self.runs, lever) if noise.size else [NO_RESPONSES] * len(self.runs)
        whitened_runs = [
            self._whitened_run(k, _local(self, at, k), one, noise, responses)
            for k, (one, responses) in enumerate(zip(noisy, driven, strict=True))
        ]
        rows = BalanceRows(self, at, tuple(whitened_runs), noise)
        started = Regression(self.unknowns, tuple(w.run for w in self.runs), rows).started(
            at if start is None else start
        )
        neutral = {n: e.nominal.get(n, 0.0) for e in self.added.effects for n in e.unknowns}
        absent = all(u.start == neutral.get(u.name, u.start) for u in started.shared)
        return replace(started, narrow=partial(narrowed, started)) if absent else started

    def heave_noise(self, at: Array) -> Array:
        """Autocovariance (m,), N^2, of the imbalance that an uneven road causes, as front load, estimated at ``at``.

        Through the body's heave; with rear loads through the axles, and (0,) on a smooth road.
        """
        return _heave_of(self, self._noisy_balances(at), at)

    def mean_imbalances(self, solution: Solution) -> list[tuple[Array, Array]]:
        """Of each run, the windows' mean imbalance as front axle load (k,), N, and its standard deviation, (k,) N."""
        at = self.unknowns_at(solution)
        noisy = self._noisy_balances(at)
        heave = _heave_of(self, noisy, at)
        return [(one.imbalance, np.sqrt(one.imbalance_band(heave)[0])) for one in noisy]

    def _noisy_balances(self, at: Array) -> list[NoisyBalance]:
        """Each run's balances of the measured channels at these unknowns, with the sensors' noise."""
        found = []
        for k, windows in enumerate(self.runs):
            balance, slopes = self.balance(windows, self.measured[k], _local(self, at, k))
            found.append(noisy_balance(windows, balance, _partials(self, slopes, windows)))
        return found

    def _whitened_run(
        self, run: int, theta: Array, noisy: NoisyBalance, heave: Array, responses: Mapping[str, Array]
    ) -> WhitenedRun:
        """One run's noise and true channels at its local unknowns.

        On an uneven road the parts that the driver causes replace the most probable channels.
        """
        windows = self.runs[run]
        factor = factored(with_heave(noisy.band, heave, noisy.scale))
        residual = whitened(factor, noisy.balance)
        channels = true_channels(windows, noisy.by_sample, weighed(factor, residual), _delays(self, theta))
        if heave.size:
            lever = self.known["antenna_height"] - float(theta[0])  # the height comes first
            channels |= driven_channels(windows, channels, lever, responses)
        true = _balance_inputs(windows, channels, TRUE_SPAN, _lever(self))
        return WhitenedRun(true, factor, residual, theta, *self.balance(windows, true, theta))

    def balance(self, windows: LoadWindows, inputs: BalanceInputs, theta: Array) -> tuple[Array, Array]:
        """Integrated balances (k,), and derivatives (k, j) by the simulators' unknowns and the pitch acceleration.

        Parameters
        ----------
        windows, inputs : of one run. theta : (u,), its local unknowns, SI: shared first.
        """
        moments, turned, _ = self.simulators
        still, turning = simulated(moments, inputs.still, theta), simulated(turned, inputs.turning, theta)
        change = windows.change @ inputs.pitch_rate

        def integrated(quiet: Mapping[str, Array], moving: Mapping[str, Array]) -> tuple[Array, Array]:
            # The balance is linear in the pitch acceleration, whose integral is the change of the pitch rate.
            added = sum((moving[n] - quiet[n] for n in turned.outputs), np.zeros(1))
            columns = (-1, *[1] * (added.ndim - 1))
            per_rate = windows.integral @ added / windows.width.reshape(columns)
            whole = windows.integral @ np.asarray(sum(quiet[n] for n in MOMENTS))
            return whole + per_rate * change.reshape(columns), per_rate

        balance, per_rate = integrated(still.outputs, turning.outputs)
        slopes, _ = integrated(still.sensitivities, turning.sensitivities)
        # In units of the read load: an effect that scales loads and motion alike must not reduce the residual.
        unit = float(still.outputs[UNIT][0])
        slopes = slopes - np.outer(balance, still.sensitivities[UNIT][0] / unit)
        return balance / unit, np.column_stack([slopes, per_rate]) / unit


def _heave_of(fit: LoadFit, noisy: Sequence[NoisyBalance], at: Array) -> Array:
    """``LoadFit.heave_noise`` from the balances of all runs at ``at``."""
    balances, bands = [one.imbalance for one in noisy], [one.imbalance_band() for one in noisy]
    if fit.both_axles:
        ways = without_driven(fit.runs, balances, fit.known["antenna_height"] - float(at[0]))
        return uneven_road(ways, bands, WINDOW, fit.known["mass"])
    return heave_autocovariance(balances, bands, WINDOW)


def _partials(fit: LoadFit, slopes: Array, windows: LoadWindows) -> dict[str, Array]:
    """Derivatives (k,) of the mean balance by each channel, and by the pitch acceleration."""
    at = fit.simulators[0].unknowns.index
    found = {n: -slopes[:, at(f"{n}_zero")] / windows.width for n in _entering(windows.loads)}
    return found | {"pitch_rate": slopes[:, -1]}


def _entering(loads: Sequence[str]) -> tuple[str, ...]:
    """The inputs of the balance that contain the noise of the loads and of the acceleration."""
    return (*loads, "acceleration", *(f"{n}_bend" for n in loads), "acceleration_rate", "acceleration_bend")


def _plausible(prior: tuple[float, float]) -> tuple[float, float]:
    """The range of a property of the vehicle; an answer of the diagnosis that needs another value explains nothing."""
    reach = CG_POLICY.cg_implausible * prior[1]
    return prior[0] - reach, prior[0] + reach


def _lever(fit: LoadFit) -> float:
    """Height of the antenna above a usual center of gravity, m, for the push that makes the tires slide."""
    return fit.known["antenna_height"] - USUAL_HEIGHT


def _local(fit: LoadFit, at: Array, run: int) -> Array:
    """The local unknowns (s + m) of one run."""
    m = sum(u.per_run for u in fit.unknowns)
    s = len(fit.unknowns) - m
    return np.concatenate([at[:s], at[s + run * m : s + (run + 1) * m]])


def _delays(fit: LoadFit, theta: Array) -> dict[str, float]:
    """Delays of the logged loads and of the acceleration at these unknowns, s."""
    values = dict(zip(fit.simulators[0].unknowns, theta.tolist(), strict=False))
    loads, _, acceleration = (_delay(fit, f"{n}_clock", values) for n in MOMENTS)
    return {"front_load": loads, "rear_load": loads, "acceleration": acceleration}


def _delay(fit: LoadFit, clock_law: str, values: Mapping[str, float]) -> float:
    """The time shift of a moment's clock with the effects of the fit, s."""
    clock: Law = attrgetter("value")
    for effect in fit.effects:
        if (law := effect.laws.get(clock_law)) is not None:
            own = {n: values.get(n, effect.nominal.get(n, 0.0)) for n in effect.unknowns}
            clock = _corrected(law, clock, Signals(**own))
    return float(clock(Signals(value=0.0)))


def _corrected(law: Callable[[Law, Signals, Signals], Number], inner: Law, q: Signals) -> Law:
    """The law ``inner``, corrected by an effect with unknowns ``q``."""
    return lambda s: law(inner, s, q)


def _balance_inputs(windows: LoadWindows, values: Mapping[str, Array], span: float, lever: float) -> BalanceInputs:
    """Inputs of the balance, with the derivatives of loads and acceleration.

    Parameters
    ----------
    values : channels (n,). span : s to either side, over which derivatives are computed.
    lever : height of the antenna above the center of gravity, m.
    """
    inputs = {n: values[n] for n in (*windows.loads, "acceleration", "pitch_rate", "pitch", "rolling", "speed")}
    inputs |= {n: values[n] for n in HEAVES if n in values}
    inputs |= {f"{n}_bend": local_derivative(values[n], windows.step, span) for n in windows.loads}
    rate = inputs["acceleration_rate"] = local_derivative(values["acceleration"], windows.step, span, 1)
    inputs["pitch_bend"] = local_derivative(values["pitch_rate"], windows.step, span, 1)
    swing = inputs["swing"] = lever * inputs["pitch_bend"]
    for name, push in (("push", values["acceleration"]), ("swing", swing), ("push_rate", rate)):
        inputs[f"{name}_speed_rate"] = local_derivative(push * values["speed"], windows.step, span, 1)
        inputs[f"{name}_bend"] = local_derivative(push, windows.step, span)
    context = {"heading": windows.heading}
    still, turning = (
        Drive(windows.time, {**inputs, "pitch_acceleration": rate}, context=context) for rate in (0.0, 1.0)
    )
    return BalanceInputs(still, turning, values["pitch_rate"])
