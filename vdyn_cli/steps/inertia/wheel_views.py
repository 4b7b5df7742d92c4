"""What to show of a wheel's inertia from the road."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.result import Comparison, Figure, Series, Table
from vdyn_cli.steps.inertia.wheel_road import Road

UNIT = "kg m^2"


def comparisons(road: Road) -> tuple[Comparison, ...]:
    """The torque that spins the wheel, window by window: from its speed, and from the hub's torque and forces."""
    return tuple(
        Comparison(run.log.name, "spin torque", "N m", run.middle, "time in s", measured, simulated)
        for run, (measured, simulated) in zip(road.runs, road.torque, strict=True)
    )


def figures(road: Road) -> tuple[Figure, ...]:
    return (_balance(road), _residual(road))


def _balance(road: Road) -> Figure:
    inertia = road.solution.values["wheel_inertia"]
    clouds = [
        Series(run.log.name, run.gained / run.duration, simulated, "points")
        for run, (_, simulated) in zip(road.runs, road.torque, strict=True)
    ]
    ends = np.array([min(float(c.x.min()) for c in clouds), max(float(c.x.max()) for c in clouds)])
    line = Series(f"{inertia:.3g} {UNIT}", ends, inertia * ends, role="simulated")
    caption = (
        "Torque left over at the hub against the wheel's acceleration, each point a window; the slope is the inertia. "
        "Good: one straight line through the origin, driving (right) and braking (left) alike. Bad: two slopes that "
        "meet at the origin or a bend (gain of torque or force, radius), a fan of loops (clock offset between torque "
        "and speed), a cloud beside the origin (torque zero)."
    )
    return Figure("balance", "The wheel's moment balance", caption, "acceleration of the wheel in rad/s^2",
                  "T - (Fx + mw a) r - frr Fz r in N m", (*clouds, line))  # fmt: skip


def _residual(road: Road) -> Figure:
    series = tuple(
        Series(run.log.name, run.middle, measured - simulated, "points", role="residual")
        for run, (measured, simulated) in zip(road.runs, road.torque, strict=True)
    )
    caption = (
        "What the balance leaves unexplained. Good: noise around zero of the same height throughout. Bad: bursts at "
        "every throttle or brake step (clock offset, gain), a slow wave (temperature, drifting zero), steps while "
        "braking (brake torque that the sensor does not see)."
    )
    return Figure("balance_residual", "Residual of the moment balance", caption, "time in s", "N m", series)


def tables(road: Road) -> tuple[Table, ...]:
    budget = road.budget.table(
        "road_budget",
        "The road's uncertainty",
        UNIT,
        "What is stated without a standard deviation counts as exact; it is not free of error for that.",
    )
    slope = road.slope
    rows = (
        ("1 kg of wheel mass", f"{slope['wheel_mass']:+.3f}"),
        ("1 mm of wheel radius", f"{1e-3 * slope['wheel_radius']:+.3f}"),
        ("0.001 of rolling resistance", f"{1e-3 * slope['rolling_resistance']:+.3f}"),
        ("0.1 % of torque gain against force gain", f"{1e-3 * slope['torque_over_force_gain']:+.3f}"),
    )
    caption = (
        "The inertia is what is left of two large torques, T and Fx r: small errors of either move it much. A pendulum "
        "knows nothing of them."
    )
    columns = ("if this were larger by", f"the inertia moves by [{UNIT}]")
    return budget, Table("leverage", "What small errors would do", columns, rows, caption)
