"""A wheel's inertia from drives on the road, including the uncertainty of the known parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from vdyn_cli.inference import Solution
from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.fit_outcome import scatter
from vdyn_cli.steps.inertia.moment_balance import MomentBalance

KNOWN = {"wheel_mass": "kg", "wheel_radius": "m", "rolling_resistance": ""}


@dataclass(frozen=True)
class RoadInertia:
    """The inertia, kg m^2, from the drives.

    Parameters
    ----------
    balance, solution : of the drives, and the fit to it.
    budget : scatter of the data, known parameters, the gain of torque against force.
    """

    balance: MomentBalance
    solution: Solution
    budget: Budget

    @property
    def slope(self) -> Mapping[str, float]:
        """Derivative of the inertia by each contribution of the budget, by name."""
        return {c.name: c.slope for c in self.budget.contributions}


def road_inertia(
    balance: MomentBalance,
    known: Mapping[str, Given],
    gain_std: float,
    added: AddedEffects,
    solution: Solution,
) -> RoadInertia:
    """The wheel's inertia at a solution of the balance's regression.

    A gain of the torque g against the force has d Jw/dg = Jw - r d Jw/dr in the budget: reading the torque as (1 + g) T
    is equivalent to dividing radius and inertia by (1 + g).

    Parameters
    ----------
    known : the balance's wheel_mass (kg), wheel_radius (m), rolling_resistance, with their standard deviations.
    gain_std : standard deviation of the torque channel's gain against the force channels'.
    added : corrections of the balance.
    """
    slopes = balance.slopes(tuple(KNOWN), solution.values, solution.per_run, added)
    inertia = solution.values["wheel_inertia"]
    per_gain = inertia - known["wheel_radius"].value * slopes["wheel_radius"]
    gain = Contribution("torque_over_force_gain", 1.0, gain_std, "", per_gain)
    taken = [Contribution(n, known[n].value, known[n].std, unit, slopes[n]) for n, unit in KNOWN.items()]
    budget = Budget(inertia, (scatter(solution, "wheel_inertia", "kg m^2"), *taken, gain))
    return RoadInertia(balance, solution, budget)
