"""Simulated logs of coast-downs not driven yet: gusty wind, an uneven road, alternating directions."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY, ROTATING_SHARE
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.campaign_checks.expected_accuracy import LONGEST_COAST
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

FINE = 0.05  # s, of the simulated motion, whose speed is nearly linear in a step; logs of any rate interpolate it
BETWEEN = 200.0  # s from the start of one coast to the next, where the description does not say
WAVELENGTHS = (250.0, 400.0, 700.0, 1200.0, 2500.0)  # m, of the road's slope: undulations within a coast of 1 to 2 km
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
    setting(
        "road_slope",
        SOURCES["roughness"].typical,
        "",
        "standard deviation of the road's slope; settings.road where stated",
        0.1,
    ),
    guess("rolling_resistance", 0.010),
    guess("drag_area", 0.65),
)


def _simulated(day: DayRequest) -> tuple[Log, ...]:
    """M' v' = -(1 + x) c0 M g - M g s(z) - rho CdA/2 (v + w) |v + w|.

    x is the scatter of each coast, s the slope of the shared road at the place z, w the mean wind and the gusts.

    Raises
    ------
    MissingParameterError : mass or air density is not known. InputError : the end speed is not below the start speed.
    """
    day.known.require("mass", "air_density", where="coastdown")
    at, rng, n = day.at, day.rng, len(day.spec.runs)
    settings = getattr(day.spec, "settings")  # noqa: B009
    window, stated = settings.speed_window, settings.road.roughness
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
    slope = _road(at["road_slope"] if stated is None else stated.value, rng)
    ahead = np.array([-1.0 if run.direction == "back" else 1.0 for run in day.spec.runs])
    resisting = np.log((rolling.mean() + drag * upper**2) / (rolling.mean() + drag * lower**2))
    begin = np.where(ahead < 0.0, 0.5 * inertia / drag * resisting, 0.0)  # m: out and back on the same road
    speed, way, rows = np.full(n, upper), np.zeros(n), list[tuple[Array, ...]]()
    while speed.max() > lower and len(rows) * FINE < LONGEST_COAST:
        air = np.maximum(speed, 0.0) + mean + wind
        grade = ahead * slope(begin + ahead * way)
        rate = -((rolling + mass * GRAVITY * grade) * (speed > 0) + drag * air * np.abs(air)) / inertia
        rows.append((speed, begin + ahead * way, rate, grade))
        speed, way = np.maximum(speed + FINE * rate, 0.0), way + FINE * speed
        wind = keep * wind + at["gust"] * np.sqrt(1 - keep**2) * rng.standard_normal(n)
    trace = np.array(rows)  # (steps, 4, n)
    return tuple(_log(day, k, trace[:, :, k], lower) for k in range(n))


def _road(std: float, rng: np.random.Generator) -> Callable[[Array], Array]:
    """The slope over the place, m: sines of random phases, with a standard deviation ``std`` over a long road."""
    turns, phases = 2.0 * np.pi / np.array(WAVELENGTHS), rng.uniform(0.0, 2.0 * np.pi, len(WAVELENGTHS))
    return lambda place: (
        std * (2.0 / phases.size) ** 0.5 * np.sin(np.multiply.outer(place, turns) + phases).sum(axis=-1)
    )


def _log(day: DayRequest, k: int, trace: Array, lower: float) -> Log:
    """One coast as logged, down to the end speed."""
    below = np.flatnonzero(trace[:, 0] <= lower)
    clock = FINE * np.arange(len(trace))
    time = day.clock(float(clock[below[0] if below.size else -1]))
    speed, place, rate, grade = (np.interp(time, clock, column) for column in trace.T)
    channels = {
        "speed": day.read(speed, "speed_noise"),
        "position": day.read(place, "position_noise"),
        "acceleration": day.read(rate + GRAVITY * grade, "acceleration_noise"),
        "grade": grade,
    }
    return Log(day.spec.runs[k].log or f"coast {k + 1}", time, channels)


PLANNED = PlannedDay(
    8,
    SETTINGS,
    _simulated,
    lambda index: {"direction": "back" if index % 2 else "out", "start": Given(BETWEEN * index)},
)
