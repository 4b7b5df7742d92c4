"""One wheel, two ways to its inertia: the pendulum's answer, and what to publish beside the road's."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, Contribution
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.inertia.wheel_road import Road
from vdyn_cli.steps.pendulum.pendulum_fit import Recording, Swings, fit_swings
from vdyn_cli.steps.pendulum.pendulum_inertia import Period, inertia_budget
from vdyn_cli.steps.pendulum.pendulum_rig import Rig

UNIT = "kg m^2"
NOTHING = 1e-6  # kg m^2
AGREE = 2.0  # standard deviations


@dataclass(frozen=True)
class Pendulum:
    """The pendulum's answer; ``swings`` where it was recorded, ``findings`` about rig and recording."""

    budget: Budget
    period: Period
    swings: Swings | None
    findings: tuple[Finding, ...]


def pendulum_inertia(rig: Rig, recording: Log | None) -> Pendulum:
    """Inertia of the wheel as it was hung.

    Raises
    ------
    ResultError : no free swing in the recording, or a period that leaves no inertia.
    """
    hung = rig.hung()
    exact = [name for name, given in hung.items() if given.std == 0]
    findings = []
    if exact:
        what = f"{', '.join(exact)} stated without a standard deviation, so taken as exact"
        findings.append(Finding("pendulum", what, "", f"write '{exact[0]}: 1.234 +- 0.001 ...'"))
    if recording is None:
        period, doubts = rig.stated_period()
        return Pendulum(inertia_budget(rig.kind, hung, period), period, None, (*findings, *doubts))
    swings = fit_swings(Recording.of(recording, rig.kind, rig.geometry()))
    solution = swings.solution
    period = Period(Given(solution.values["period"], solution.std["period"]), solution.degrees["period"])
    for knock in swings.knocks:
        what = f"the swing was knocked at {knock:.2f} s; what lies before and after is fitted as two swings"
        findings.append(Finding(recording.name, what, "", "let it swing freely, and hang it so that it does not slip"))
    return Pendulum(inertia_budget(rig.kind, hung, period), period, swings, (*recording.findings, *findings))


def advice(budget: Budget) -> str:
    main = budget.main
    return f"most of it comes from {main.name.replace('_', ' ')}: know that better" if main else ""


def apart(road: Road, pendulum: Pendulum) -> float:
    """How far the road's value lies above the pendulum's, in standard deviations of the difference."""
    return (road.budget.value - pendulum.budget.value) / float(np.hypot(road.budget.std, pendulum.budget.std))


def published(road: Road | None, pendulum: Pendulum | None) -> tuple[Budget, str]:
    """What to publish, and why in words."""
    if pendulum is None:
        assert road is not None
        return road.budget, _leverage(road)
    if road is None:
        main = pendulum.budget.main
        why = f" {main.name.replace('_', ' ').capitalize()} contributes most to it." if main else ""
        return pendulum.budget, f"It comes from the pendulum.{why}"
    gap, both = apart(road, pendulum), f"road {_pm(road.budget)}, pendulum {_pm(pendulum.budget)} {UNIT}"
    stated = road.budget.contributions[1].std > 0 and road.budget.contributions[2].std > 0
    if not stated:
        return pendulum.budget, (
            f"It is the pendulum's ({both}): the road's wheel mass or radius is given without a standard deviation."
        )
    if abs(gap) > AGREE:
        return pendulum.budget, (
            f"It is the pendulum's; the road disagrees by {abs(gap):.1f} standard deviations ({both}). "
            f"{cure(road, pendulum)}"
        )
    weight = np.array([road.budget.std, pendulum.budget.std]) ** -2.0
    weight = weight / weight.sum()
    value = float(weight @ np.array([road.budget.value, pendulum.budget.value]))
    parts = tuple(
        Contribution(name, b.value, b.std, UNIT, float(w), b.degrees)
        for name, b, w in zip(("road", "pendulum"), (road.budget, pendulum.budget), weight, strict=True)
    )
    share = "nearly all" if weight[1] > 0.995 else f"{weight[1]:.0%}"
    agree = f"Road and pendulum agree within {abs(gap):.1f} standard deviations ({both})"
    words = f"{agree}; the pendulum has {share} of the weight."
    return Budget(value, parts), words


def value(budget: Budget) -> str:
    (low, high), places = budget.interval95, _places(budget.std)
    return f"{budget.value:.{places}f} (95 %: {low:.{places}f} to {high:.{places}f})"


def _pm(budget: Budget) -> str:
    places = _places(budget.std)
    return f"{budget.value:.{places}f} +- {budget.std:.{places}f}"


def _places(size: float) -> int:
    """Decimals that show two digits of an uncertainty."""
    return 4 if size <= 0 else min(max(1 - int(np.floor(np.log10(size))), 0), 9)


def cure(road: Road, pendulum: Pendulum) -> str:
    """What would bring the two together, one at a time."""
    gap, slope = road.budget.value - pendulum.budget.value, road.slope
    return (
        f"{abs(1000 * gap / slope['wheel_radius']):.2g} mm of wheel radius, "
        f"{abs(100 * gap / slope['torque_over_force_gain']):.2g} % between the gains of torque and force, or "
        f"{abs(gap / slope['wheel_mass']):.2g} kg of wheel mass would close the gap."
    )


def _leverage(road: Road) -> str:
    doubts = (
        ("2 kg of wheel mass", "wheel_mass", 2.0),
        ("1 mm of radius", "wheel_radius", 1e-3),
        ("0.5 % between the gains of torque and force", "torque_over_force_gain", 5e-3),
    )
    # An extension may have freed one of them: then it moves nothing any more.
    moved = [(what, abs(size * road.slope[name])) for what, name, size in doubts]
    told = [f"{what} is {value:.2g}" for what, value in moved if value > NOTHING]
    if not told:
        return ""
    return f"On the road only Jw + mw r^2 is observable: {', '.join(told)} {UNIT}."
