"""Sentences and tables of a wheel-inertia test."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.number_text import number, two_digits
from vdyn_cli.quantities.parameters import Estimate
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.inertia.wheel_inertia import UNIT, PendulumInertia, radius_or_mass_exact, standard_distance
from vdyn_cli.steps.interval_text import with_interval

METHODS = (
    "Road: the wheel's moment balance is integrated over windows of a quarter of a second (setting window), so that "
    "the wheel's speed is never differentiated. Least squares on the impulses, whitened by the noise of torque, forces "
    "and speed (adjacent windows share one speed sample); each run's torque zero is a nuisance parameter within the "
    "sensors' data sheets. Intervals follow from the scatter of blocks of equal information (Bell and McCaffrey 2002) "
    "and from the standard deviations of wheel mass, radius, rolling resistance and gain, to first order. Pendulum: "
    "least squares of the recording, split at a disturbance, with the nonlinear equation of motion with viscous, dry "
    "and air friction and the sensor's zero; uncertainties of period and rig are propagated to first order."
)
NOTHING = 1e-6  # kg m^2, below which a change is not listed
ALL = 0.995  # share of the weight above which it rounds to 100 %


def sentence(estimates: Mapping[str, Estimate], _extra: Mapping[str, Any], origin: str) -> str:
    """The headline: the published inertia, and a sentence on its origin."""
    return f"One wheel's moment of inertia is {with_interval(estimates['wheel_inertia'], UNIT)}. {origin}"


def origin(answer: Budget, road: RoadInertia | None, pendulum: PendulumInertia | None) -> str:
    """Sentence on the method of the published inertia, and on the agreement of two methods.

    Parameters
    ----------
    answer : the published one. road, pendulum : the inertia by each method; None where it was not used.
    """
    if road is None:
        main = f" {_label(answer)} contributes most to its uncertainty." if answer.main else ""
        return f"It was measured with the pendulum.{main}"
    if pendulum is None:
        return _leverage(road)
    both = f"road {_plus_minus(road.budget)}, pendulum {_plus_minus(pendulum.budget)} {UNIT}"
    apart = abs(standard_distance(road, pendulum))
    if radius_or_mass_exact(road):
        return f"It is the pendulum's value ({both}): wheel mass or radius on the road have no standard deviation."
    if answer is pendulum.budget:
        gap = closing_the_gap(road, pendulum)
        return f"It is the pendulum's value; the road disagrees by {apart:.1f} standard deviations ({both}). {gap}"
    weight = answer.contributions[1].slope
    share = "nearly all" if weight > ALL else f"{100 * weight:.0f} %"
    agree = f"Road and pendulum agree: they differ by {two_digits(apart)} standard deviations ({both})"
    return f"{agree}; the pendulum has {share} of the weight."


def _plus_minus(budget: Budget) -> str:
    return f"{number(budget.value, budget.std)} +- {two_digits(budget.std)}"


def _label(budget: Budget) -> str:
    return budget.main.name.replace("_", " ").capitalize() if budget.main else ""


def not_determined(answer: Budget) -> tuple[str, str]:
    """The value with its interval, and the remedy, for an interval that contains zero."""
    low, high = answer.interval95
    remedy = f"{_label(answer)} contributes most to the uncertainty: measure it more accurately" if answer.main else ""
    return f"{answer.value:.3g} {UNIT}, 95 %: {low:.3g} to {high:.3g}", remedy


def closing_the_gap(road: RoadInertia, pendulum: PendulumInertia) -> str:
    """Sentence on the errors that would each explain the difference of road and pendulum."""
    gap, slope = road.budget.value - pendulum.budget.value, road.slope
    return (
        f"{abs(1000 * gap / slope['wheel_radius']):.2g} mm of wheel radius, "
        f"{abs(100 * gap / slope['torque_over_force_gain']):.2g} % between the gains of torque and force, or "
        f"{abs(gap / slope['wheel_mass']):.2g} kg of wheel mass would explain the difference."
    )


def _leverage(road: RoadInertia) -> str:
    doubts = (
        ("2 kg of wheel mass", "wheel_mass", 2.0),
        ("1 mm of radius", "wheel_radius", 1e-3),
        ("0.5 % between the gains of torque and force", "torque_over_force_gain", 5e-3),
    )
    # An extension may have made one of them an unknown: then it changes nothing.
    moved = [(what, abs(size * road.slope[name])) for what, name, size in doubts]
    parts = [f"{what} changes it by {value:.2g}" for what, value in moved if value > NOTHING]
    return f"On the road only Jw + mw r^2 is observable: {', '.join(parts)} {UNIT}." if parts else ""


def tables(road: RoadInertia | None, pendulum: PendulumInertia | None) -> tuple[Table, ...]:
    """Tables of the comparison of both methods, and of the uncertainty of each; None for one that was not used."""
    found = []
    if road is not None and pendulum is not None:
        found.append(_comparison(road, pendulum))
    if road is not None:
        caption = "Inputs without a standard deviation are assumed exact."
        found += [road.budget.table("road_budget", "The road's uncertainty", UNIT, caption), _leverage_table(road)]
    if pendulum is not None:
        caption = "Slope: change of the inertia per unit of the input."
        found.append(pendulum.budget.table("pendulum_budget", "The pendulum's uncertainty", UNIT, caption))
    return tuple(found)


def _comparison(road: RoadInertia, pendulum: PendulumInertia) -> Table:
    gap, std = road.budget.value - pendulum.budget.value, np.hypot(road.budget.std, pendulum.budget.std)
    rows = (
        ("road", f"{road.budget.value:.4f}", f"{road.budget.std:.2g}"),
        ("pendulum", f"{pendulum.budget.value:.4f}", f"{pendulum.budget.std:.2g}"),
        ("road minus pendulum", f"{gap:+.4f}", f"{std:.2g}"),
        ("in standard deviations", f"{standard_distance(road, pendulum):+.1f}", ""),
    )
    columns = ("from", f"inertia [{UNIT}]", "standard deviation")
    return Table("two_ways", "Road against pendulum", columns, rows, closing_the_gap(road, pendulum))


def _leverage_table(road: RoadInertia) -> Table:
    slope = road.slope
    rows = (
        ("1 kg of wheel mass", f"{slope['wheel_mass']:+.3f}"),
        ("1 mm of wheel radius", f"{1e-3 * slope['wheel_radius']:+.3f}"),
        ("0.001 of rolling resistance", f"{1e-3 * slope['rolling_resistance']:+.3f}"),
        ("0.1 % of torque gain against force gain", f"{1e-3 * slope['torque_over_force_gain']:+.3f}"),
    )
    caption = (
        "The inertia is the small difference of two large torques, T and Fx r: small errors of either change it "
        "considerably. A pendulum's value does not depend on them."
    )
    columns = ("increase of", f"change of the inertia [{UNIT}]")
    return Table("leverage", "Effect of small errors", columns, rows, caption)
