"""Figures of a wheel-inertia test: the moment balance on the road, and the residual of the pendulum's oscillation."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.inertia.road_inertia import RoadInertia
from vdyn_cli.steps.inertia.wheel_inertia import UNIT
from vdyn_cli.steps.pendulum.pendulum_fit import FittedSwing

SWING_UNITS = {"angle": "rad", "angular_rate": "rad/s"}
AVERAGED = 20  # parts of a period, over which the residual is averaged to make slow shapes visible


def comparisons(road: RoadInertia | None, swing: FittedSwing | None) -> tuple[Comparison, ...]:
    """The net torque in each window from the wheel's speed and at the hub; the recording and its fit."""
    found = []
    if road is not None:
        found += [
            Comparison(run.log.name, "spin torque", "N m", run.middle, "time in s", measured, simulated)
            for run, (measured, simulated) in zip(road.runs, road.torque, strict=True)
        ]
    if swing is not None:
        recording, unit = swing.recording, SWING_UNITS[swing.recording.channel]
        found.append(
            Comparison(recording.name, recording.channel, unit, recording.time, "time in s", recording.values,
                       swing.simulated)
        )  # fmt: skip
    return tuple(found)


def figures(road: RoadInertia | None, swing: FittedSwing | None) -> tuple[Figure, ...]:
    """Figures of the balance and residual of the road, and of the residual of the pendulum, for what was measured."""
    of_road = () if road is None else (_balance(road), _balance_residual(road))
    return of_road if swing is None else (*of_road, _swing_residual(swing))


def _balance(road: RoadInertia) -> Figure:
    inertia = road.solution.values["wheel_inertia"]
    clouds = [
        Series(run.log.name, run.gained / run.duration, simulated, "points")
        for run, (_, simulated) in zip(road.runs, road.torque, strict=True)
    ]
    ends = np.array([min(float(c.x.min()) for c in clouds), max(float(c.x.max()) for c in clouds)])
    line = Series(f"{inertia:.3g} {UNIT}", ends, inertia * ends, role="simulated")
    caption = (
        "Net torque at the hub over the wheel's acceleration, one point per window; the slope is the inertia. "
        "Good: one straight line through the origin, driving (right) and braking (left) alike. Bad: two slopes that "
        "meet at the origin or a bend (gain of torque or force, radius), a fan of loops (clock offset between torque "
        "and speed), a cloud beside the origin (torque zero)."
    )
    return Figure("balance", "The wheel's moment balance", caption, "acceleration of the wheel in rad/s^2",
                  "T - (Fx + mw a) r - frr Fz r in N m", (*clouds, line))  # fmt: skip


def _balance_residual(road: RoadInertia) -> Figure:
    series = tuple(
        Series(run.log.name, run.middle, measured - simulated, "points", role="residual")
        for run, (measured, simulated) in zip(road.runs, road.torque, strict=True)
    )
    caption = (
        "Residual of the balance. Good: noise around zero of the same height throughout. Bad: bursts at "
        "every throttle or brake step (clock offset, gain), a slow wave (temperature, drifting zero), steps while "
        "braking (brake torque that the sensor does not measure)."
    )
    return Figure("balance_residual", "Residual of the moment balance", caption, "time in s", "N m", series)


def _swing_residual(swing: FittedSwing) -> Figure:
    recording = swing.recording
    step = float(np.median(np.diff(recording.time)))
    width = max(1, round(swing.solution.values["period"] / AVERAGED / step))
    count = recording.time.size // width * width
    time = recording.time[:count].reshape(-1, width).mean(axis=1)
    left = (recording.values - swing.simulated)[:count].reshape(-1, width).mean(axis=1)
    expected = np.full(2, 2 * swing.noise / width**0.5)
    series = [
        Series("measured minus fitted", time, left, role="residual"),
        Series("twice the sensor's noise", time[[0, -1]], -expected, "band", expected, role="muted"),
    ]
    size = float(np.abs(left).max())
    for moment in swing.disturbances:
        series.append(Series("disturbance", np.full(2, moment), np.array([-size, size]), role="accent"))
    caption = (
        "Residual of the fitted oscillation. Good: noise within the band. Bad: a wave with the pendulum's period that "
        "comes and goes (a disturbance, or a slowly moving pivot), twice its frequency (friction, large amplitudes), "
        "another frequency (the wheel also rocks sideways)."
    )
    unit = SWING_UNITS[recording.channel]
    return Figure("swing_residual", "Residual of the oscillation", caption, "time in s", unit, tuple(series))
