"""A wheel's inertia from drives on the road, including the uncertainty of the known parameters."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.inference import Solution, Unknown, solve
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.inertia.moment_balance import DriveWindows, MomentBalance

KNOWN = {"wheel_mass": "kg", "wheel_radius": "m", "rolling_resistance": ""}


@dataclass(frozen=True)
class RoadInertia:
    """The inertia, kg m^2, from the drives.

    Parameters
    ----------
    runs, solution : the windows, and the fit to them.
    moment : kg m, mass times radius of the wheel as stated.
    torque : for each run, the mean net torque in its windows, (w,) N m, from the wheel's speed (Jw times the mean
        angular acceleration), and from torque and forces at the hub.
    budget : scatter of the data, known parameters, the gain of torque against force.
    """

    runs: tuple[DriveWindows, ...]
    solution: Solution
    moment: float
    torque: tuple[tuple[Array, Array], ...]
    budget: Budget

    @property
    def slope(self) -> Mapping[str, float]:
        """Derivative of the inertia by each contribution of the budget, by name."""
        return {c.name: c.slope for c in self.budget.contributions}


def road_inertia(
    balance: MomentBalance,
    known: Mapping[str, Given],
    gain_std: float,
    effects: Sequence[Correction] = (),
    unknowns: Sequence[Unknown] = (),
) -> RoadInertia:
    """Estimate the wheel's inertia from its hub's torque, forces and speed.

    Parameters
    ----------
    known : the balance's wheel_mass (kg), wheel_radius (m), rolling_resistance, with their standard deviations.
    gain_std : standard deviation of the torque channel's gain against the force channels'.
    effects, unknowns : corrections of the balance, and their unknowns.

    Raises
    ------
    ResultError : the fit fails, or the logs do not give a plausible inertia.
    """
    solution = solve(balance.regression(balance.first_inertia, effects, unknowns))
    return road_inertia_at(solution, balance, known, gain_std, effects, unknowns)


def road_inertia_at(
    solution: Solution,
    balance: MomentBalance,
    known: Mapping[str, Given],
    gain_std: float,
    effects: Sequence[Correction] = (),
    unknowns: Sequence[Unknown] = (),
) -> RoadInertia:
    """The estimate at a solution of the balance's regression; parameters as of :func:`road_inertia`."""
    torque = tuple(
        torque_in_windows(run, solution, white, balance.moment)
        for run, white in zip(balance.runs, solution.residuals, strict=True)
    )
    shared, zeros = list(solution.values.values()), solution.per_run["hub_torque_zero"]
    slopes = balance.slopes(tuple(KNOWN), shared, zeros, effects, unknowns)
    return RoadInertia(balance.runs, solution, balance.moment, torque, _budget(solution, known, slopes, gain_std))


def torque_in_windows(run: DriveWindows, solution: Solution, white: Array, moment: float) -> tuple[Array, Array]:
    """Mean net torque in each window, (w,) N m, from the wheel's speed, and from the hub's torque and forces.

    Parameters
    ----------
    white : (w,), whitened residuals of the run. moment : kg m, mass times radius of the wheel.
    """
    factor = run.noise.factor(solution.values["wheel_inertia"], moment)
    excess = factor[0] * white
    excess[1:] += factor[1, :-1] * white[:-1]
    measured = solution.values["wheel_inertia"] * run.gained / run.duration
    return measured, measured + excess / run.duration


def _budget(solution: Solution, known: Mapping[str, Given], slopes: Mapping[str, float], gain_std: float) -> Budget:
    """The uncertainty budget; a gain of the torque g against the force has d Jw/dg = Jw - r d Jw/dr.

    Reading the torque as (1 + g) T is equivalent to dividing radius and inertia by (1 + g).
    """
    name, inertia = "wheel_inertia", solution.values["wheel_inertia"]
    gain = inertia - known["wheel_radius"].value * slopes["wheel_radius"]
    scatter = Contribution("scatter_of_the_data", inertia, solution.std[name], "kg m^2", 1.0, solution.degrees[name])
    taken = [Contribution(n, known[n].value, known[n].std, unit, slopes[n]) for n, unit in KNOWN.items()]
    return Budget(inertia, (scatter, *taken, Contribution("torque_over_force_gain", 1.0, gain_std, "", gain)))
