"""One regression over the logs of both half-shafts, which share the unknowns of effects."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import Regression, Rows, Solution, solve
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restrict import restricted
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.effect_estimates import unbounded, unknowns_of_profiles
from vdyn_cli.steps.shaft.shaft_fit import ARRIVED, ShaftFit, unknowns_and_change

CLEARLY = 10.0  # reduction of the cost by which a probe must fit better than no effect
PROBED = 2  # every second probe is tried
# Standard deviations of an adjusted twist, beyond which a corner of the law is tried: readings near a closer one are
# adjusted to the flank that suits their noise, so that any corner there fits better than a straight line.
PROBE_NOISE = 3.0
READJUSTMENTS, SETTLED = 5, 0.3  # of the readings, until no unknown changes by more standard deviations
BAR = 2  # unknowns of a side's bar, stiffness and damping, which come first


def combined_regression(sides: Mapping[str, Regression]) -> Regression:
    """The rows of all runs over the unknowns [bar of each side | shared by the sides | the run's own].

    Parameters
    ----------
    sides : the regression of each side. Assumes that all have the same effects: equal shared unknowns after the first
        ``BAR``, and equal own unknowns.
    """
    common = next(iter(sides.values()))
    bars = [replace(u, name=f"{u.name}_{side}") for side, regression in sides.items() for u in regression.shared[:BAR]]
    shared = common.shared[BAR:]
    runs = [(at, side, k) for at, side in enumerate(sides) for k in range(len(sides[side].runs))]

    def rows(index: int, theta: Array) -> Rows:
        at, side, run = runs[index]
        own = np.r_[BAR * at : BAR * (at + 1), len(bars) : theta.size]
        found = sides[side].rows(run, theta[own])
        jacobian = np.zeros((found.residual.size, theta.size))
        jacobian[:, own] = found.jacobian
        return replace(found, jacobian=jacobian)

    names = tuple(sides[side].runs[run] for _, side, run in runs)
    starts = [regression.run_starts for regression in sides.values()]
    own = {name: np.concatenate([s[name] for s in starts]) for name in starts[0]}
    return Regression((*bars, *shared, *common.own), names, rows, own)


def regression_with_effects(fit: ShaftFit, linear: Solution) -> Regression:
    """The regression of one side with effects, its readings adjusted at the fit with those whose laws are smooth.

    Profiles, and corners that no probe shows, are held at zero there: their fit would follow the noise of the readings,
    from which readings adjusted at it would then depend. Where the runs do not determine the fit, the readings are
    adjusted at the last fit that they determine.

    Parameters
    ----------
    linear : the solution without effects.
    """
    start = fit.unknowns_at(linear)
    probed = _probed(fit, linear)
    whole = replace(fit, added=unbounded(probed))
    corners = {u for effect in fit.added.effects if effect.probes for u in effect.unknowns}
    held = {u.name: 0.0 for u in probed.unknowns if u.name in corners and not u.start}
    held |= unknowns_of_profiles(fit.added.effects)

    def step(at: Array) -> tuple[Array, float]:
        try:
            solution = solve(restricted(whole.frozen_regression(at), held), tolerance=ARRIVED)
        except ResultError:
            return at, 0.0
        return unknowns_and_change(whole, at, solution)

    first = start if probed == fit.added else whole.fit_holding_effects(linear)[0]
    return fit.frozen_regression(until_settled(step, first, READJUSTMENTS, SETTLED).state, start)


def _probed(fit: ShaftFit, linear: Solution) -> AddedEffects:
    """The effects, each started at its best-fitting probe where that fits clearly better than no effect."""
    found = list(fit.added.unknowns)
    names = [u.name for u in found]
    for effect in fit.added.effects:
        amplitude = next(iter(effect.unknowns))
        if not effect.probes or amplitude not in names:
            continue
        at = names.index(amplitude)
        least = ShaftFit(fit.runs, AddedEffects((effect,))).fit_holding_effects(linear)[1] - CLEARLY
        most = max(float(np.ptp(run.twist)) for run in fit.runs) / 2
        resolved = PROBE_NOISE * max(run.twist_error(linear.values["shaft_stiffness"]) for run in fit.runs)
        for probe in (p for p in effect.probes[::PROBED] if resolved < p < most):
            tried = replace(fit.added.unknowns[at], start=probe)
            try:
                cost = ShaftFit(fit.runs, AddedEffects((effect,), (tried,))).fit_holding_effects(linear)[1]
            except ResultError:
                continue
            if cost < least:
                least, found[at] = cost, tried
    return replace(fit.added, unknowns=tuple(found))
