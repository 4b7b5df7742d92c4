"""Simulated logs of tip-ins not driven yet: steps of torque on one half-shaft, and its twist."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting
from vdyn_cli.steps.shaft.spec import SIDES, ShaftSpec

SETTINGS = (
    setting("torque", 400.0, "N m", "torque of a tip-in", 20_000.0, 1.0),
    setting("duration", 4.0, "s", "duration of a log: a tip-in, then a tip-out at half of it", 600.0, 0.5),
    setting("frequency", 5.0, "Hz", "natural frequency of the driveline", 100.0, 0.1),
    setting("damping_ratio", 0.08, "", "damping ratio of the driveline", 1.0),
    setting("wheel_speed_level", 20.0, "rad/s", "speed of the wheel", 300.0, 0.1),
    setting("rate", 1000.0, "Hz", "samples a second", 20_000.0, 1.0),
    setting("torque_noise", 1.5, "N m", "white noise of the shaft torque", 200.0),
    setting("twist_noise", 5.2e-5, "rad", "white noise of the twist", 0.1),
    setting("wheel_speed_noise", 0.015, "rad/s", "white noise of both speeds", 5.0),
    guess("shaft_stiffness_left", 8_000.0),
    guess("shaft_stiffness_right", 8_000.0),
    guess("shaft_damping_left", 50.0),
    guess("shaft_damping_right", 50.0),
)


def _log(day: DayRequest, k: int) -> Log:
    """T = k phi + c phi', with a twist that follows steps of torque as a damped oscillator."""
    spec, at = day.spec, day.at
    assert isinstance(spec, ShaftSpec)
    run = spec.runs[k]
    stiffness, damping = at[f"shaft_stiffness_{run.side}"], at[f"shaft_damping_{run.side}"]
    time = day.clock(at["duration"])
    step, w = float(time[1] - time[0]), 2 * np.pi * at["frequency"]
    wanted = at["torque"] / stiffness * ((time > 0.1 * at["duration"]) & (time < 0.55 * at["duration"]))
    twist, rate, rows = 0.0, 0.0, []
    for goal in wanted:
        rows.append((twist, rate))
        rate += step * (w**2 * (goal - twist) - 2 * at["damping_ratio"] * w * rate)
        twist += step * rate
    angle, turning = np.array(rows).T
    ratio = spec.settings.gear_ratio.value
    wheel = np.full(time.size, at["wheel_speed_level"])
    channels = {
        "shaft_torque": day.read(stiffness * angle + damping * turning, "torque_noise"),
        "twist": day.read(angle, "twist_noise"),
        "wheel_speed": day.read(wheel, "wheel_speed_noise"),
        "motor_speed": day.read(ratio * (wheel + turning), "wheel_speed_noise"),
    }
    return Log(run.log or f"tip-in {k + 1}", time, channels)


PLANNED = PlannedDay(
    4,
    SETTINGS,
    lambda day: tuple(_log(day, k) for k in range(len(day.spec.runs))),
    lambda index: {"side": SIDES[index % len(SIDES)]},
)
