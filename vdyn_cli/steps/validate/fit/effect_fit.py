"""Amplitudes of the effects that extend the model, by repeatedly relinearized fits.

A linearization about the car without effects is too inaccurate for a large amplitude, so it is repeated about its
result until the estimates settle. With free play the likelihood has many local maxima, where one impact fits well; the
fit then restarts at the maximum of the profile likelihood.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, Solution, solve
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.linearized_regression import linearized
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.validate.car.simulation import SimulationSetup, nondifferentiable
from vdyn_cli.steps.validate.fit.nondifferentiable import (
    AROUND,
    DifferentiableReference,
    likely_cost,
    profile_estimates,
)
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE

PASSES = 4  # largest number of linearizations
SETTLED = 0.1  # standard deviations by which the last pass may move an unknown
UNCONVERGED = 1.0  # standard deviations, move of an amplitude in the last pass from which it is reported
AGAIN = 0.4  # standard deviations between the fit and the profile likelihood, beyond which the fit restarts
StartedRegression = Callable[[SimulationSetup, Mapping[str, float]], Regression]
FEWEST_UNITS = 8  # number of drives cut into windows from which a drive is one independent unit


@dataclass(frozen=True, eq=False)
class FittedEffects:
    """The estimated amplitudes of effects.

    Parameters
    ----------
    setup : with the effects at their estimates. solution : of the last fit. linearized : its regression.
    spreads : standard deviations of nondifferentiable amplitudes, which the linearized fit underestimates.
    moved : largest move of an amplitude in the last pass, in standard deviations.
    """

    setup: SimulationSetup
    solution: Solution
    linearized: Regression
    spreads: Mapping[str, float]
    moved: float

    @property
    def doubts(self) -> tuple[Finding, ...]:
        """A finding where the estimates have not converged."""
        if self.moved < UNCONVERGED:
            return ()
        what = (
            f"estimates of the effects have not converged: the last pass moved them by {self.moved:.1f} standard errors"
        )
        return (Finding("fit", what, "", "their intervals are too narrow: do not rely on them", doubt=True),)


def fit_effects(
    setup: SimulationSetup,
    regression: StartedRegression,
    reference: DifferentiableReference,
) -> FittedEffects:
    """Fit the amplitudes of the setup's effects to the drives.

    Parameters
    ----------
    regression : setup, values -> regression of the drives at its start, and at these values of channels' errors.
    reference : the car without nondifferentiable effects.

    Raises
    ------
    ResultError : the drives do not determine the amplitudes, or a simulation is not finite.
    """
    last = _relinearized_until_settled(setup, regression, {})
    profiled = profile_estimates(last.setup, reference)
    if any(abs(at - last.solution.values[n]) > AGAIN * std for n, (at, std) in profiled.items()):
        added = last.setup.added.started_at({n: at for n, (at, _) in profiled.items()})
        last = _relinearized_until_settled(replace(last.setup, added=added), regression, last.solution.values)
        profiled = profile_estimates(last.setup, reference)
    solution = last.solution
    # With local maxima, the last move and the difference of the two estimates add to the uncertainty.
    spreads = {
        n: float(np.linalg.norm([std, at - solution.values[n], last.moves[n]])) for n, (at, std) in profiled.items()
    }
    std = {**solution.std, **spreads}
    moved = max((move / std[n] for n, move in last.moves.items() if std[n] > 0.0), default=0.0)
    return FittedEffects(last.setup.begun_at({}), solution, last.linearized, spreads, moved)


def size_beside_parameters(
    setups: Callable[[float], SimulationSetup],
    regression: StartedRegression,
    reference: DifferentiableReference,
    size: float,
) -> tuple[float, float] | None:
    """The amplitude of play by the best of several linearized fits of all unknowns, started around ``size``.

    The time to cross a gap is proportional to the cube root of gap times inertia: with an inertia that is 5 % off, the
    best gap is 15 % off unless both are fitted together.

    Parameters
    ----------
    setups : amplitude -> the setup with the effect of this amplitude. size : rad, most likely at the prior parameters.

    Returns
    -------
    Amplitude, rad, after that fit, and its negative log likelihood; None where no simulation succeeds.
    """
    found: dict[float, float] = {}
    for share in AROUND:
        try:
            after = _relinearized(setups(share * size), regression, {})[0].setup
            found[after.added.unknowns[0].start] = likely_cost(reference, after)
        except (ResultError, ArithmeticError):
            continue
    return min(found.items(), key=lambda one: one[1], default=None)


@dataclass(frozen=True, eq=False)
class _Pass:
    """One linearization: the setup at its result, its solution and regression, and the moves of the amplitudes."""

    setup: SimulationSetup
    solution: Solution
    linearized: Regression
    moves: Mapping[str, float]


def _relinearized_until_settled(
    setup: SimulationSetup, regression: StartedRegression, values: Mapping[str, float]
) -> _Pass:
    first, moved = _relinearized(setup, regression, values)
    if moved < SETTLED:
        return first

    def again(one: _Pass) -> tuple[_Pass, float]:
        return _relinearized(one.setup, regression, one.solution.values)

    return until_settled(again, first, PASSES - 1, SETTLED).state


def _relinearized(
    setup: SimulationSetup, regression: StartedRegression, values: Mapping[str, float]
) -> tuple[_Pass, float]:
    """The fit linearized at a setup's start and these values of channels' errors; its largest move in std deviations.

    The square of a latency, which its linearization about zero omits, would be attributed to an effect.
    """
    start = dict(zip(setup.vector.shared, setup.vector.theta.tolist(), strict=True))
    system = linearized(regression(setup, values))
    by_run = SENSED_SLOPE in setup.model.inputs and len(system.runs) >= FEWEST_UNITS
    solution = solve(system, units="run" if by_run else "block")
    moves = {n: abs(solution.values[n] - at) for n, at in start.items() if n in solution.values}
    amplitudes = {n: moves[n] for n in setup.added.names}
    begun = setup.begun_at(solution.values) if setup.model.name == "vehicle" else setup
    after = replace(begun, added=setup.added.started_at(solution.values))
    judged = moves if nondifferentiable(setup.effects) else amplitudes
    return _Pass(after, solution, system, amplitudes), solution.move_from({n: start[n] for n in judged})


def fitted(setup: SimulationSetup, solution: Solution) -> SimulationSetup:
    """The extended setup with its parameters at the estimates of a fit.

    Parameters
    ----------
    solution : of a fit whose unknowns include the parameters of the prior.
    """
    moved = {n: solution.values[n] for n in setup.prior.names}
    prior = replace(setup.prior, values={**setup.prior.values, **moved})
    return setup.moved_to(replace(setup.point, car=replace(setup.point.car, prior=prior)))
