"""One regression over the logs of both half-shafts: each side its own bar, causes in common."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import Effect
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.effect_estimates import unbounded
from vdyn_cli.steps.shaft.fit import ARRIVED, ShaftFit, Twisting

Array = NDArray[np.float64]

CLEARLY = 10.0  # of the cost, by which a probe must fit better than nothing
PROBED = 2  # every second probe
ROUNDS, MOVED = 5, 0.3  # of adjusting the readings anew, until nothing moves by more standard deviations
BAR = 2  # unknowns of a side's bar, stiffness and damping, which come first


def both_sides(sides: Mapping[str, Regression]) -> Regression:
    """The rows of every side's runs over [bar of each side | what the sides share | the run's own].

    Parameters
    ----------
    sides : the regression of each, all with the same effects.
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


def about_effects(
    runs: Sequence[Twisting], effects: Sequence[Effect], extra: Sequence[Unknown], bar: tuple[float, float] | None
) -> Regression:
    """One side with effects, its readings adjusted as the fit with all of them asks, if the runs determine that.

    With priors on the effects' unknowns they mostly do; else the readings stay adjusted as the last fit asks that did.
    """
    fit = ShaftFit(runs, extra, effects, bar)
    straight = solve(ShaftFit(runs).regression())
    start = fit.place(straight)
    begun = _probed(runs, effects, extra, straight)
    whole = ShaftFit(runs, unbounded(begun), effects, bar)
    at = start if begun == tuple(extra) else whole.begun(straight)[0]
    for _ in range(ROUNDS):
        try:
            solution = solve(whole.regression(at), tolerance=ARRIVED)
        except ResultError:
            break
        before, at = at, whole.place(solution)
        std = np.array([solution.std[n] for n in solution.names])
        if np.max(np.abs(at - before)[: std.size] / std) < MOVED:
            break
    return fit.regression(at, start)


def _probed(
    runs: Sequence[Twisting], effects: Sequence[Effect], extra: Sequence[Unknown], straight: Solution
) -> tuple[Unknown, ...]:
    """The unknowns begun at the probe that fits best, where one fits clearly better than nothing."""
    begun = list(extra)
    for effect in effects:
        size = next(iter(effect.unknowns))
        at = next((i for i, u in enumerate(extra) if u.name == size), None)
        if not effect.probes or at is None:
            continue
        least = ShaftFit(runs, (), (effect,)).begun(straight)[1] - CLEARLY
        most = max(float(np.ptp(run.twist)) for run in runs) / 2
        for probe in (p for p in effect.probes[::PROBED] if p < most):
            tried = replace(extra[at], start=probe)
            try:
                cost = ShaftFit(runs, (tried,), (effect,)).begun(straight)[1]
            except ResultError:
                continue
            if cost < least:
                least, begun[at] = cost, tried
    return tuple(begun)
