"""What to show of a wheel's inertia from its pendulum."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.result import Comparison, Figure, Series, Table
from vdyn_cli.steps.pendulum.pendulum_fit import Swings

UNITS = {"angle": "rad", "angular_rate": "rad/s"}


def comparison(swings: Swings) -> Comparison:
    """The recording against the fitted swing."""
    recording = swings.recording
    unit = UNITS[recording.channel]
    measured, simulated = recording.values, swings.simulated
    return Comparison(recording.name, recording.channel, unit, recording.time, "time in s", measured, simulated)


def figure(swings: Swings) -> Figure:
    """The residual, averaged over a twentieth of a period so that slow shapes can be seen."""
    recording = swings.recording
    step = float(np.median(np.diff(recording.time)))
    width = max(1, round(swings.solution.values["period"] / 20 / step))
    count = recording.time.size // width * width
    time = recording.time[:count].reshape(-1, width).mean(axis=1)
    left = (recording.values - swings.simulated)[:count].reshape(-1, width).mean(axis=1)
    series = [Series("measured less fitted", time, left, role="residual")]
    expected = np.full(2, 2 * swings.noise / width**0.5)
    ends = np.array([time[0], time[-1]])
    series.append(Series("twice the sensor's noise", ends, -expected, "band", expected, role="muted"))
    for knock in swings.knocks:
        size = float(np.abs(left).max())
        series.append(Series("knock", np.full(2, knock), np.array([-size, size]), role="accent"))
    caption = (
        "What the fitted swing leaves. Good: noise within the band. Bad: a wave of the swing's own period that comes "
        "and goes (a knock, or a pivot that creeps), twice its frequency (friction, wide swings), another frequency "
        "(the wheel also rocks sideways)."
    )
    unit = UNITS[recording.channel]
    return Figure("swing_residual", "Residual of the swing", caption, "time in s", unit, tuple(series))


def table(budget: Budget) -> Table:
    caption = "Slope: how the inertia moves when the input grows by one unit."
    return budget.table("pendulum_budget", "The pendulum's uncertainty", "kg m^2", caption)
