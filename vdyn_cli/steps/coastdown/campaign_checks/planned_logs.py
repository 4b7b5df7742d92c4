"""Simulated logs of coast-downs not driven yet: gusty wind, level road, alternating directions."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY, ROTATING_SHARE
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

FINE = 0.05  # s, of the simulated motion, whose speed is nearly linear in a step; logs of any rate interpolate it
LONGEST_COAST = 900.0  # s, of a simulated coast
BETWEEN = 200.0  # s from the start of one coast to the next, where the description does not say
SETTINGS = (
    setting(
        "start_speed", 80 / 3.6, "m/s", "speed at which a coast begins; speed_window where it is stated", 80.0, 1.0
    ),
    setting("end_speed", 20 / 3.6, "m/s", "speed at which a coast ends; speed_window where it is stated", 60.0),
    setting("rate", 10.0, "Hz", "samples a second", 1000.0, 1.0),
    setting("speed_noise", 0.03, "m/s", "white noise of the speed", 1.0),
    setting("position_noise", 0.3, "m", "white noise of the position", 10.0),
    setting("acceleration_noise", 0.03, "m/s^2", "white noise of the acceleration", 2.0),
    setting("gust", 0.6, "m/s", "standard deviation of the wind within a coast", 5.0),
    setting("gust_time", 8.0, "s", "correlation time of the gusts", 100.0),
    setting("run_wind", 0.3, "m/s", "standard deviation of the mean wind between coasts", 5.0),
    setting("rolling_scatter", 0.01, "", "relative scatter of rolling resistance between coasts", 0.2),
    guess("rolling_resistance", 0.010),
    guess("drag_area", 0.65),
)


def _run(index: int) -> Mapping[str, Any]:
    return {"direction": "back" if index % 2 else "out", "start": Given(BETWEEN * index)}


def _simulated(day: DayRequest) -> tuple[Log, ...]:
    """M' v' = -(1 + x) c0 M g - rho CdA/2 (v + w) |v + w|, w the mean wind and the gusts, x the scatter of each coast.

    Raises
    ------
    MissingParameterError : mass or air density is not known. InputError : the end speed is not below the start speed.
    """
    day.known.require("mass", "air_density", where="coastdown")
    at, rng, n = day.at, day.rng, len(day.spec.runs)
    window = getattr(day.spec, "settings").speed_window  # noqa: B009
    upper, lower = (w.value for w in window) if window else (at["start_speed"], at["end_speed"])
    if upper <= lower:
        got = f"start_speed {upper:.4g}, end_speed {lower:.4g} m/s"
        remedy = "plan with an end_speed below the start_speed"
        raise InputError(Finding("plan", "the end speed is not below the start speed of the coasts", got, remedy))
    mass = day.known["mass"].value
    inertia = mass + day.known.value("rotating_mass", ROTATING_SHARE * mass)
    rolling = at["rolling_resistance"] * mass * GRAVITY * (1.0 + at["rolling_scatter"] * rng.standard_normal(n))
    drag = 0.5 * day.known["air_density"].value * at["drag_area"]
    keep = float(np.exp(-FINE / max(at["gust_time"], FINE)))
    mean, wind = at["run_wind"] * rng.standard_normal(n), at["gust"] * rng.standard_normal(n)
    speed, way, rows = np.full(n, upper), np.zeros(n), list[tuple[Array, Array, Array]]()
    while speed.max() > lower and len(rows) * FINE < LONGEST_COAST:
        air = np.maximum(speed, 0.0) + mean + wind
        rate = -(rolling * (speed > 0) + drag * air * np.abs(air)) / inertia
        rows.append((speed, way, rate))
        speed, way = np.maximum(speed + FINE * rate, 0.0), way + FINE * speed
        wind = keep * wind + at["gust"] * np.sqrt(1 - keep**2) * rng.standard_normal(n)
    trace = np.array(rows)  # (steps, 3, n)
    return tuple(_log(day, k, trace[:, :, k], lower) for k in range(n))


def _log(day: DayRequest, k: int, trace: Array, lower: float) -> Log:
    """One coast as logged, down to the end speed."""
    below = np.flatnonzero(trace[:, 0] <= lower)
    clock = FINE * np.arange(len(trace))
    time = day.clock(float(clock[below[0] if below.size else -1]))
    speed, way, rate = (np.interp(time, clock, column) for column in trace.T)
    run = day.spec.runs[k]
    out = run.direction != "back"
    length = float(trace[-1, 1])
    channels = {
        "speed": day.read(speed, "speed_noise"),
        "position": day.read(way if out else length - way, "position_noise"),
        "acceleration": day.read(rate, "acceleration_noise"),
        "grade": np.zeros(time.size),
    }
    return Log(run.log or f"coast {k + 1}", time, channels)


PLANNED = PlannedDay(8, SETTINGS, _simulated, _run)
