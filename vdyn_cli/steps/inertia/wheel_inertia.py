"""One wheel, two methods: its inertia from the pendulum, and which of road and pendulum is published."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.inverse_variance import weighted_mean
from vdyn_cli.steps.pendulum.pendulum_fit import FittedSwing
from vdyn_cli.steps.pendulum.pendulum_inertia import MeasuredPeriod, inertia_budget
from vdyn_cli.steps.pendulum.pendulum_rig import Rig
from vdyn_cli.steps.step_policy import STEP_POLICY

UNIT = "kg m^2"


@dataclass(frozen=True)
class PendulumInertia:
    """The inertia, kg m^2, of the hung wheel; ``swing`` where it was recorded, ``findings`` about the rig."""

    budget: Budget
    period: MeasuredPeriod
    swing: FittedSwing | None
    findings: tuple[Finding, ...]


def pendulum_inertia(rig: Rig, swing: FittedSwing | None) -> PendulumInertia:
    """Inertia of the wheel as it was hung.

    Parameters
    ----------
    swing : the fit to the recording, None where the period was given or timed.

    Raises
    ------
    ResultError : a period that leaves no inertia.
    """
    hung = rig.hung()
    exact = [name for name, given in hung.items() if given.std == 0]
    findings = []
    if exact:
        what = f"{', '.join(exact)} without a standard deviation: assumed exact"
        findings.append(Finding("pendulum", what, "", f"write '{exact[0]}: 1.234 +- 0.001 ...'"))
    if swing is None:
        period, doubts = rig.stated_period()
        return PendulumInertia(inertia_budget(rig.kind, hung, period), period, None, (*findings, *doubts))
    values, std, degrees = swing.solution.values, swing.solution.std, swing.solution.degrees
    period = MeasuredPeriod(Given(values["period"], std["period"]), degrees["period"])
    for time in swing.disturbances:
        what = f"the swing was disturbed at {time:.2f} s: the parts before and after are fitted as two swings"
        remedy = "let it swing freely, and fix the suspension so that it does not slip"
        findings.append(Finding(swing.recording.name, what, "", remedy))
    return PendulumInertia(inertia_budget(rig.kind, hung, period), period, swing, tuple(findings))


def standard_distance(road: RoadInertia, pendulum: PendulumInertia) -> float:
    """Road less pendulum, in standard deviations of the difference."""
    return (road.budget.value - pendulum.budget.value) / float(np.hypot(road.budget.std, pendulum.budget.std))


def radius_or_mass_exact(road: RoadInertia) -> bool:
    """Whether the road's wheel mass or radius has no standard deviation, so that the road's is too small."""
    return any(c.std == 0 for c in road.budget.contributions if c.name in ("wheel_mass", "wheel_radius"))


def published_inertia(road: RoadInertia | None, pendulum: PendulumInertia | None) -> Budget:
    """What is published of one or both methods, of which at least one is given.

    Where both agree and the road's uncertainty is complete, their mean weighted by inverse variance. Else the
    pendulum's: nothing but lengths, mass and time enters it.
    """
    if pendulum is None:
        assert road is not None
        return road.budget
    if road is None or radius_or_mass_exact(road) or abs(standard_distance(road, pendulum)) > STEP_POLICY.agreeing_std:
        return pendulum.budget
    return weighted_mean({"road": road.budget, "pendulum": pendulum.budget}, UNIT)
