"""The inertia of a wheel from its pendulum, and the choice between road and pendulum."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget, weighted_mean
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.failure import UnpublishedError
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.pendulum.pendulum_fit import FreeSwing
from vdyn_cli.steps.pendulum.pendulum_inertia import MeasuredPeriod, inertia_budget
from vdyn_cli.steps.pendulum.pendulum_rig import Rig
from vdyn_cli.steps.step_policy import STEP_POLICY

UNIT = "kg m^2"


@dataclass(frozen=True)
class PendulumInertia:
    """The inertia, kg m^2, of the suspended wheel; ``swing`` where it was recorded, ``findings`` about the rig."""

    budget: Budget
    period: MeasuredPeriod
    swing: FreeSwing | None
    findings: tuple[Finding, ...]


def pendulum_inertia(rig: Rig, swing: FreeSwing | None) -> PendulumInertia:
    """Inertia of the wheel in its suspension, from the period of small oscillations.

    Parameters
    ----------
    rig : the suspension with its measured quantities. swing : the recording, None where the period was given or timed.

    Raises
    ------
    ResultError : the fit to the recording fails; the period is too short, so that the inertia is not positive.
    """
    hung = rig.hung()
    exact = [name for name, given in hung.items() if given.std == 0]
    findings = []
    if exact:
        what = f"no standard deviation of {', '.join(exact)} is given: assumed exact"
        findings.append(Finding("pendulum", what, "", f"write '{exact[0]}: 1.234 +- 0.001 ...'"))
    if swing is None:
        period, doubts = rig.stated_period()
        return PendulumInertia(inertia_budget(rig.kind, hung, period), period, None, (*findings, *doubts))
    fit = swing.solution
    period = MeasuredPeriod(Given(fit.values["period"], fit.std["period"]), fit.degrees["period"])
    for time in swing.disturbances:
        what = f"the oscillation was disturbed at {time:.2f} s: the parts before and after are fitted separately"
        remedy = "let it swing freely, and fix the suspension so that it does not slip"
        findings.append(Finding(swing.recording.name, what, "", remedy))
    return PendulumInertia(inertia_budget(rig.kind, hung, period), period, swing, tuple(findings))


def standard_distance(road: RoadInertia, pendulum: PendulumInertia) -> float:
    """Road minus pendulum, in standard deviations of the difference: (J_r - J_p) / sqrt(u_r^2 + u_p^2)."""
    return (road.budget.value - pendulum.budget.value) / float(np.hypot(road.budget.std, pendulum.budget.std))


def radius_or_mass_exact(road: RoadInertia) -> bool:
    """Whether wheel mass or radius have no standard deviation, so that the road's uncertainty is too small."""
    return any(c.std == 0 for c in road.budget.contributions if c.name in ("wheel_mass", "wheel_radius"))


def published_inertia(road: RoadInertia | None, pendulum: PendulumInertia | None) -> Budget:
    """The published inertia, kg m^2, from one or both methods, of which at least one is given.

    Where both agree within ``agreeing_std`` and the road's uncertainty is complete, it is their mean weighted by
    inverse variance. Otherwise it is the pendulum's, which depends only on lengths, mass and time.
    """
    if pendulum is None:
        assert road is not None
        return road.budget
    if road is None or radius_or_mass_exact(road) or abs(standard_distance(road, pendulum)) > STEP_POLICY.agreeing_std:
        return pendulum.budget
    return weighted_mean({"road": road.budget, "pendulum": pendulum.budget}, UNIT)


def refuse_zero(result: Result, got: str, remedy: str) -> None:
    """Refuse a result where the interval of the inertia contains zero.

    Raises
    ------
    UnpublishedError : it does; ``got`` and ``remedy`` are those of the finding.
    """
    if result.parameters["wheel_inertia"].interval95[0] <= 0:
        what = "is not determined: its interval contains zero"
        raise UnpublishedError((Finding("wheel_inertia", what, got, remedy),), result)
