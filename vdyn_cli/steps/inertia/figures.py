"""Figures of a wheel-inertia test: the moment balance on the road, and the residual of the pendulum's oscillation."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.inertia.wheel_inertia import UNIT
from vdyn_cli.steps.pendulum.pendulum_fit import FreeSwing

SWING_UNITS = {"angle": "rad", "angular_rate": "rad/s"}
AVERAGED = 20  # parts of a period, over which the residual is averaged to make slow shapes visible


def swing_comparison(swing: FreeSwing) -> Comparison:
    """The recording and its fit."""
    r = swing.recording
    return Comparison(r.name, r.channel, SWING_UNITS[r.channel], r.time, "time in s", r.values, swing.simulated)


def balance(inertia: float, torques: Sequence[Comparison]) -> Figure:
    """Figure of the balance; ``inertia`` in kg m^2, ``torques`` as of :func:`spin_torques`."""
    clouds = [Series(c.run, c.measured / inertia, c.simulated, "points") for c in torques]
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


def balance_residual(torques: Sequence[Comparison]) -> Figure:
    """Figure of the balance's residual over time."""
    series = tuple(Series(c.run, c.x, c.measured - c.simulated, "points", role="residual") for c in torques)
    caption = (
        "Residual of the balance. Good: noise around zero of the same height throughout. Bad: bursts at "
        "every throttle or brake step (clock offset, gain), a slow wave (temperature, drifting zero), steps while "
        "braking (brake torque that the sensor does not measure)."
    )
    return Figure("balance_residual", "Residual of the moment balance", caption, "time in s", "N m", series)


def swing_residual(swing: FreeSwing) -> Figure:
    """Figure of the residual of the fitted oscillation, averaged over parts of a period."""
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
