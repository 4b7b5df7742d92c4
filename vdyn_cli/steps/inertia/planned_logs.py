"""Simulated logs of wheel-inertia drives not driven yet: throttle and brake pulses, hub force sensor."""

from __future__ import annotations

import numpy as np

from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.inertia.problem import ANY_TIRE
from vdyn_cli.steps.inertia.spec import InertiaSpec
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

ROLLS = 0.7  # s without throttle or brake between two pulses
SLIP_STIFFNESS = 20.0  # 1, friction over slip of a car's tire near zero slip
HUMPS = 6  # waves of the road, each of 1 % of the load
LAG = 0.07  # s, time constant of throttle and brake, applied twice
SETTINGS = (
    setting("start_speed", 12.0, "m/s", "speed at which a drive begins", 60.0, 1.0),
    setting("acceleration_level", 2.8, "m/s^2", "acceleration and deceleration of a pulse", 10.0, 0.1),
    setting("speed_change", 6.5, "m/s", "speed gained in a throttle pulse and lost in a brake pulse", 40.0, 0.1),
    setting("duration", 30.0, "s", "length of a drive", 3600.0, 5.0),
    setting("wheel_load", 4000.0, "N", "vertical load of the wheel", 50_000.0, 100.0),
    setting("carried_mass", 635.0, "kg", "mass that the wheel's longitudinal force accelerates", 20_000.0, 1.0),
    setting("rate", 200.0, "Hz", "samples a second", 5000.0, 1.0),
    setting("torque_noise", 2.0, "N m", "white noise of the hub torque", 200.0),
    setting("force_noise", 12.0, "N", "white noise of the hub forces", 1000.0),
    setting("wheel_speed_noise", 0.01, "rad/s", "white noise of the wheel speed", 5.0),
    setting("acceleration_noise", 0.03, "m/s^2", "white noise of the acceleration", 2.0),
    setting("speed_noise", 0.02, "m/s", "white noise of the vehicle speed", 1.0),
    guess("wheel_inertia", 1.2),
)


def _simulated(day: DayRequest) -> tuple[Log, ...]:
    """T = J om' + (Fx + mw a) r + frr (Fz + mw g) r, with om = v (1 + slip) / r.

    Raises
    ------
    InputError : the description has a pendulum. MissingParameterError : mass or radius of the wheel is not known.
    """
    spec = day.spec
    assert isinstance(spec, InertiaSpec)
    if spec.pendulum is not None:
        remedy = "record one oscillation of the wheel: 'vdyn inertia' needs one log, and states its error"
        raise InputError(Finding("pendulum", "a pendulum cannot be planned", remedy=remedy))
    day.known.require("wheel_mass", "wheel_radius", where="inertia")
    return tuple(_log(day, spec, k) for k in range(len(spec.runs)))


def _log(day: DayRequest, spec: InertiaSpec, k: int) -> Log:
    at, known, rng = day.at, day.known, day.rng
    mass, radius = known["wheel_mass"].value, known["wheel_radius"].value
    time = day.clock(at["duration"])
    rate = _pulses(day, time)
    speed = np.maximum(at["start_speed"] + cumulative_integral(time, rate), 0.5)
    humps = np.sin(2 * np.pi * np.outer(time, rng.uniform(0.3, 3.0, HUMPS))) @ rng.uniform(0.005, 0.015, HUMPS)
    load, force = at["wheel_load"] * (1.0 + humps), at["carried_mass"] * rate
    spin = speed * (1.0 + force / load / SLIP_STIFFNESS) / radius
    rolling = known.value("rolling_resistance", ANY_TIRE.value)
    torque = at["wheel_inertia"] * np.gradient(spin, time) + (force + rolling * load) * radius
    zero = spec.settings
    channels = {
        "hub_torque": day.read(torque, "torque_noise", zero.torque_zero.value),
        "wheel_speed": day.read(spin, "wheel_speed_noise"),
        "hub_force_x": day.read(force - mass * rate, "force_noise", zero.force_zero.value),
        "hub_force_z": day.read(load - mass * GRAVITY, "force_noise", zero.force_zero.value),
        "acceleration": day.read(rate, "acceleration_noise"),
        "vehicle_speed": day.read(speed, "speed_noise"),
    }
    return Log(spec.runs[k].log or f"drive {k + 1}", time, channels)


def _pulses(day: DayRequest, time: Array) -> Array:
    """Acceleration (n,) of the car: a repeated cycle of throttle, rolling, brake, rolling, with random amplitudes."""
    from scipy.signal import lfilter

    level, rng, wanted, now = day.at["acceleration_level"], day.rng, np.zeros(time.size), ROLLS
    while now < time[-1]:
        for sign in (1.0, -1.0):
            size = level * rng.uniform(0.8, 1.2)
            end = now + day.at["speed_change"] / size
            wanted[(time >= now) & (time < end)] = sign * size
            now = end + ROLLS
    keep = float(np.exp(-(time[1] - time[0]) / LAG))
    lag = np.poly([keep, keep])
    return np.asarray(lfilter([(1 - keep) ** 2], lag, wanted))


PLANNED = PlannedDay(3, SETTINGS, _simulated)
