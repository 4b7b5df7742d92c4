"""Output-error fit of bump crossings: springs, dampers and tires from all channels of all runs at once."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Simulated, Simulator, sensitive_to
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.physics.models.half_car import BODY, BODY_OF, CROSSING, GIVEN, SOUGHT, sprung_body
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.bump.crossing import Crossing
from vdyn_cli.steps.bump.known_car import HUBS, KnownCar, usual_car
from vdyn_cli.steps.bump.measured_channels import MeasuredChannels
from vdyn_cli.steps.bump.noise import MISFIT, ChannelWeights
from vdyn_cli.steps.bump.road_noise import RoadNoise, road_noise
from vdyn_cli.steps.contract import NO_VALUES

LARGEST_STEP = 1.1e-3  # s, of the integration: its error of the loads is a hundredth of a load cell's noise
TOLERANCE = 1e-3  # of a residual's variance: lift-off is nondifferentiable, so that steps gain less than expected
# Unknowns of effects that are zero, simulated together: of 1 to 32, 24 cost least in time of simulation and of building
AT_ONCE = 24
REWEIGHTINGS = 3  # of the channels, at most: each costs a whole fit
AT_REST = (2e-3, 2e-2, 1e-3, 1e-2)  # m, m/s, rad, rad/s: standard deviations of the body's motion on a smooth road


@dataclass(frozen=True)
class BumpFit:
    """Crossings, and the unknowns estimated from them.

    Shared unknowns are the five of ``SOUGHT``, uncertain known numbers, and those of the effects. Unknowns of each run
    are the position of the bump, scale and slope of the speed (in units of their standard deviations), motion of the
    body at the start, and zero of each sensor.

    Parameters
    ----------
    added : corrections of the half car.
    sensitive : unknowns whose sensitivities are simulated; empty: all.
    road : the noise of an uneven road; None on a smooth one.
    """

    crossings: tuple[Crossing, ...]
    model: Model
    known: KnownCar
    weights: ChannelWeights
    added: AddedEffects = NO_EFFECTS
    sensitive: tuple[str, ...] = ()
    road: RoadNoise | None = None

    @property
    def channels(self) -> tuple[str, ...]:
        """The channels that every crossing has."""
        return tuple(self.weights.inflation)

    @cached_property
    def start(self) -> Mapping[str, float]:
        """Start values of the five unknowns: those of a typical car."""
        return usual_car(self.known.values)

    @cached_property
    def shared(self) -> tuple[Unknown, ...]:
        """The unknowns that all crossings share."""
        values, std, ranges = self.known.values, self.known.std, self.known.ranges()
        sought = [PARAMETERS[n] for n in SOUGHT]
        uncertain = [n for n in GIVEN if std.get(n, 0.0) > 0.0]
        return (
            *(Unknown(q.name, self.start[q.name], q.lower, q.upper, q.unit) for q in sought),
            *(Unknown(n, values[n], *ranges[n], prior=(values[n], std[n]), nuisance=True) for n in uncertain),
            *self.added.unknowns,
        )

    @cached_property
    def own(self) -> tuple[Unknown, ...]:
        """The unknowns of each crossing: those of the simulation, then the sensors' zeros."""
        priors = {"speed_scale": 1.0, "speed_ramp": 1.0}
        priors |= {f"start.{n}": s for n, s in zip(BODY, AT_REST, strict=True)}
        priors |= {f"{n}_zero": self.known.zeros[n] for n in self.channels}
        unknowns = [Unknown("distance_front", 0.0, -np.inf, np.inf, "m")]
        unknowns += [Unknown(n, 0.0, prior=(0.0, std)) for n, std in priors.items()]
        return tuple(replace(u, per_run=True, nuisance=True) for u in unknowns)

    @cached_property
    def simulator(self) -> Simulator:
        """The half car with all unknowns except the sensors' zeros."""
        whole = self.simulator_of([u.name for u in (*self.shared, *self.own[: len(CROSSING) + len(BODY)])])
        return sensitive_to(whole, self.sensitive) if self.sensitive else whole

    @cached_property
    def scales(self) -> tuple[Array, ...]:
        """For each crossing, SI units per unit of each simulated unknown, (k,); not 1 for errors of the speed."""
        scales = []
        for crossing in self.crossings:
            scale = np.ones(len(self.simulator.unknowns))
            at = len(self.shared) + CROSSING.index("speed_scale")
            scale[at] = np.hypot(crossing.speed.scale_std, self.known.speed_scale)
            scale[at + 1] = crossing.speed.ramp_std
            scales.append(scale)
        return tuple(scales)

    @cached_property
    def _narrowed(self) -> dict[tuple[tuple[str, ...], tuple[str, ...]], BumpFit]:
        """Cache of fits with some of the effects, by the names of their unknowns and of the sensitive ones."""
        return {}

    def only(self, names: Sequence[str], sensitive: Sequence[str] = ()) -> BumpFit:
        """The fit with only these unknowns of effects, and without the effects that have none of them."""
        unknowns = tuple(u for u in self.added.unknowns if u.name in names)
        free, seen = tuple(u.name for u in unknowns), tuple(u.name for u in unknowns if u.name in sensitive)
        if (free, seen) not in self._narrowed:
            effects = tuple(e for e in self.added.effects if set(e.unknowns) & set(free))
            narrowed = replace(self, added=AddedEffects(effects, unknowns), sensitive=seen)
            self._narrowed[free, seen] = narrowed
        return self._narrowed[free, seen]

    def simulator_of(self, unknowns: Sequence[str]) -> Simulator:
        """The half car with these unknowns, the others at their start values."""
        step = max(float(np.median(np.diff(c.time))) for c in self.crossings)
        values = {**self.known.values, **self.start, **dict.fromkeys(CROSSING, 0.0)}
        values |= {u.name: u.start for u in self.shared}
        return Simulator(self.model, values, unknowns, self.added.effects, substeps=int(np.ceil(step / LARGEST_STEP)))

    def regression(self, at: Solution | None = None, start: Mapping[str, float] = NO_VALUES) -> Regression:
        """The whitened regression over all runs, started at a solution, at ``start``, or at a typical car.

        Its rows can be restricted to some shared unknowns; effects without any of them are then not simulated.
        """
        begin = {**start, **(at.values if at else {})}
        shared = tuple(replace(u, start=begin.get(u.name, u.start)) for u in self.shared)
        own = dict(at.per_run) if at else {}
        own.setdefault("distance_front", np.array([c.distance for c in self.crossings]))
        runs = tuple(c.run for c in self.crossings)
        return Regression((*shared, *self.own), runs, BumpRows(self), own, lambda names: BumpRows(self.only(names)))

    def solve(self) -> tuple[BumpFit, Solution]:
        """Fit, and refit with channels weighted by their residual where that exceeds their noise.

        Returns
        -------
        This fit with the weights of the last round, and the solution.

        Raises
        ------
        ResultError : the unknowns are not determined.
        """

        def reweight(state: tuple[BumpFit, Solution]) -> tuple[tuple[BumpFit, Solution], float]:
            fit, solution = state
            misfit = fit.misfit(solution)
            mismatch = fit.weights.mismatch(misfit)
            if mismatch < MISFIT:
                return state, mismatch
            fit = replace(fit, weights=fit.weights.reweighted(misfit))
            return (fit, solve(fit.regression(solution), tolerance=TOLERANCE)), mismatch

        first = (self, solve(self.regression(_with_effects_fixed(self)), tolerance=TOLERANCE))
        return until_settled(reweight, first, REWEIGHTINGS, MISFIT).state

    def simulate(self, run: int, theta: Array, *, sensitivities: bool = True, states: bool = False) -> Simulated:
        """One run simulated at its local unknowns ``theta`` (k,): shared, then its own."""
        scale, drive = self.scales[run], self.crossings[run].drive
        return self.simulator(drive, theta[: scale.size] * scale, sensitivities=sensitivities, states=states)

    def measured(self, run: int) -> MeasuredChannels:
        """The fitted channels of one crossing with their weights."""
        crossing = self.crossings[run]
        deviation = {n: self.weights.deviation(crossing, n) for n in self.channels}
        whitened = partial(self.road.whitened, crossing, deviation=deviation) if self.road else None
        return MeasuredChannels(crossing.time, {n: crossing.channels[n] for n in self.channels}, deviation, whitened)

    def misfit(self, solution: Solution) -> dict[str, float]:
        """Root mean square of each channel's residual over its inflated noise."""
        return self.weights.misfit(self.crossings, solution.residuals)

    def arms(self, values: Mapping[str, float]) -> dict[str, float]:
        """Distance of each axle ahead of the body's center of gravity, m."""
        at = {**self.known.values, **values}
        _, to_front = sprung_body(*(at[n] for n in BODY_OF))
        return {"front": to_front, "rear": to_front - at["wheelbase"]}


def on_its_road(fit: BumpFit) -> BumpFit:
    """The fit with the noise of the road before the bump, by a typical car, then by the car as fitted with it."""
    road = road_noise(fit.crossings, {**fit.known.values, **fit.start})
    if road is None:
        return fit
    found = replace(fit, road=road)
    with suppress(ResultError):
        _, solution = found.solve()
        found = replace(fit, road=road_noise(fit.crossings, {**fit.known.values, **solution.values}) or road)
    return found


def with_soft_hubs(fit: BumpFit, rolling: Model) -> BumpFit:
    """The fit with the fore-aft compliance of the hubs as unknowns; the same fit where that is not a real car's.

    An estimate at the end of its range stands for another error, such as that of a tire that averages the road.
    Wheels that roll over the bump as circles hide soft hubs from a fit with point contact: where that path explains
    every channel to its noise, the hubs have the compliance estimated with it, since point contact would change it.

    Parameters
    ----------
    rolling : the half car with wheels that roll over the bump as circles.
    """
    soft = replace(fit, known=fit.known.with_soft_hubs())
    with suppress(ResultError):
        soft.solve()
        return soft
    with suppress(ResultError):
        weighted, solution = replace(soft, model=rolling).solve()
        if max(weighted.weights.inflation.values()) == 1.0:
            return replace(fit, known=fit.known.with_values({n: solution.values[n] for n in HUBS}))
    return fit


def _with_effects_fixed(fit: BumpFit) -> Solution | None:
    """The fit of the car with effects fixed at their start values; None where these are zero, or the fit fails.

    Started at a typical car, a correct effect would first change to compensate for the errors of the car.
    """
    held = {u.name: u.start for u in fit.added.unknowns}
    if not any(held.values()):
        return None
    try:
        return solve(restricted(fit.regression(), held), tolerance=TOLERANCE)
    except ResultError:
        return None


def _in_groups(effects: Sequence[Effect]) -> list[list[str]]:
    """The unknowns of the effects in groups of at most ``AT_ONCE``; those of an effect that shifts a clock alone.

    A shifted channel is interpolated with its rate, which the model gives only without some of the other effects.
    """
    groups = [list(effect.unknowns) for effect in effects if effect.shifts_clock]
    groups.append([])
    for effect in effects:
        if effect.shifts_clock:
            continue
        if len(groups[-1]) + len(effect.unknowns) > AT_ONCE:
            groups.append([])
        groups[-1] += effect.unknowns
    return [group for group in groups if group]


@dataclass(frozen=True)
class BumpRows:
    """The whitened rows of a fit, with residuals that can be evaluated at lower cost without derivatives."""

    fit: BumpFit

    def __call__(self, run: int, theta: Array) -> Rows:
        """Whitened residuals of one run, channel by channel; samples without a reading are left out."""
        scale = self.fit.scales[run]
        return self.fit.measured(run).rows(self.linearized(run, theta), theta[scale.size :], scale)

    def linearized(self, run: int, theta: Array) -> Simulated:
        """One run with sensitivities at its local unknowns ``theta`` (k,), equal to ``BumpFit.simulate``.

        Effects that are zero do not interact, so the sensitivities to some of them at a time are simulated, together
        with the nonzero effects. This costs half as much as each by itself, or all at once.
        """
        fit = self.fit
        values = dict(zip((u.name for u in fit.shared), theta.tolist(), strict=False))
        resting = [e for e in fit.added.effects if not any(values.get(n) for n in e.unknowns if n not in e.nominal)]
        if len(resting) < 2:
            return fit.simulate(run, theta)
        zero = {n for e in resting for n in e.unknowns}
        acting = [u.name for u in fit.added.unknowns if u.name not in zero]
        names = [u.name for u in (*fit.shared, *fit.own)]
        parts = [fit.only(acting), *(fit.only([*acting, *some], some) for some in _in_groups(resting))]
        found = [one.simulate(run, theta[[names.index(n) for n in one.simulator.unknowns]]) for one in parts]
        whole = {n: np.zeros((found[0].time.size, len(fit.simulator.unknowns))) for n in fit.channels}
        for one, simulated in zip(parts, found, strict=True):
            columns = [names.index(n) for n in one.sensitive or one.simulator.unknowns]
            for channel in fit.channels:
                whole[channel][:, columns] = simulated.sensitivities[channel]
        return replace(found[0], sensitivities=whole)

    def residual(self, run: int, theta: Array) -> Array:
        """The whitened residuals (n,) of one run, as in the rows."""
        simulated = self.fit.simulate(run, theta, sensitivities=False)
        return self.fit.measured(run).residual(simulated, theta[self.fit.scales[run].size :])
