"""Simulated logs of bump crossings not driven yet: half car, described bump, speeds about the planned one."""

from __future__ import annotations

from collections.abc import Mapping
from functools import partial

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.half_car import CROSSING, SOUGHT, half_car
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.bump.crossing import BEFORE
from vdyn_cli.steps.bump.known_car import known_car, usual_car
from vdyn_cli.steps.bump.spec import BumpSpec
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

DISTANCE = Given(6.0, 0.03)  # m from the log's start to the bump, where the description states none
SPREAD = 0.25  # of the speed, to either side: at one speed only, springs and dampers are nearly collinear
LASTS = 3.0  # s of a log after the rear axle's crossing


def _usual(name: str, spec: BumpSpec, known: Parameters) -> float:
    return usual_car(known_car(spec, known)[0].values)[name]


SETTINGS = (
    setting("speed", 4.7, "m/s", "speed of a crossing; the crossings vary by up to 25 % about it", 30.0, 0.5),
    setting("rate", 500.0, "Hz", "samples a second", 5000.0, 1.0),
    setting("load_noise", 17.0, "N", "white noise of an axle's load", 1000.0),
    setting("acceleration_noise", 0.03, "m/s^2", "white noise of the vertical acceleration", 2.0),
    setting("pitch_rate_noise", 8.7e-4, "rad/s", "white noise of the pitch rate", 0.2),
    setting("speed_noise", 0.02, "m/s", "white noise of the speed", 1.0),
    *(guess(name, partial(_usual, name)) for name in SOUGHT),
)


def _simulated(day: DayRequest) -> tuple[Log, ...]:
    """The simulated logs of the crossings.

    Raises
    ------
    InputError : the bump has a measured profile, or parameters of the car are missing.
    """
    spec = day.spec
    assert isinstance(spec, BumpSpec)
    if spec.obstacle.profile is not None:
        what = "a plan needs height, width and shape: it cannot use a measured profile"
        remedy = "plan with 'bump: {height, width, shape}' of about the same size, or drive one crossing"
        raise InputError(Finding("bump.profile", what, remedy=remedy))
    values = {**known_car(spec, day.known)[0].values, **{n: day.at[n] for n in SOUGHT}}
    return tuple(_log(day, spec, values, k) for k in range(len(spec.runs)))


def _log(day: DayRequest, spec: BumpSpec, values: Mapping[str, float], k: int) -> Log:
    settings, run, n = spec.settings, spec.runs[k], len(spec.runs)
    pace = day.at["speed"] * (1 + SPREAD * (2 * (k + 0.5) / n - 1))
    stated = run.distance_front or DISTANCE
    distance = float(stated.value + stated.std * day.rng.standard_normal())
    time = day.clock(max(distance / pace, BEFORE) + values["wheelbase"] / pace + LASTS)
    model = half_car("half_sine" if spec.obstacle.shape == "half_sine" else "haversine")
    at = {**values, **dict.fromkeys(CROSSING, 0.0), "distance_front": distance}
    simulator = Simulator(model, {name: at[name] for name in model.parameters}, substeps=2)
    drive = Drive(time, {"speed": pace, "elapsed": time}, {"position": 0.0})
    seen = simulator(drive, sensitivities=False).outputs
    load_zero, acceleration_zero = 2**0.5 * settings.load_zero.value, settings.acceleration_zero.value
    scale = 1 + settings.speed_scale.value * day.rng.standard_normal()
    channels = {
        "front_load": day.read(seen["front_load"], "load_noise", load_zero),
        "rear_load": day.read(seen["rear_load"], "load_noise", load_zero),
        "speed": day.read(np.full(time.size, scale * pace), "speed_noise"),
        "vertical_acceleration": day.read(seen["vertical_acceleration"], "acceleration_noise", acceleration_zero),
        "pitch_rate": day.read(seen["pitch_rate"], "pitch_rate_noise", settings.pitch_rate_zero.value),
    }
    return Log(run.log or f"crossing {k + 1}", time, channels)


PLANNED = PlannedDay(4, SETTINGS, _simulated, lambda index: {"distance_front": DISTANCE})
