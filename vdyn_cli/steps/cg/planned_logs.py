"""Simulated logs of accelerate-and-brake runs not driven yet: pulses of acceleration, and the pitch response."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.load_transfer import LOAD_TRANSFER, MOMENTS, MOTION, SOUGHT, ZEROS
from vdyn_cli.quantities.arrays import Array, cumulative_integral
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.cg.known_vehicle import known_vehicle
from vdyn_cli.steps.cg.load_windows import rolling_flag
from vdyn_cli.steps.cg.local_derivative import SPAN, local_derivative
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

LOAD_ROUNDS = 3  # iterations of the loads and their second derivatives, which change them by 1 %
PULSES = 4  # of the throttle and of the brake in a run
RAMP = 0.15  # s in which a pulse builds up
BUILD_UP = 2.5  # s of throttle, to gain the speed that the brake pulses then remove
SETTINGS = (
    setting("start_speed", 6.0, "m/s", "speed at which a run begins", 60.0, 1.0),
    setting("acceleration_level", 2.5, "m/s^2", "acceleration of a throttle pulse", 10.0, 0.1),
    setting("braking_level", 5.0, "m/s^2", "deceleration of a brake pulse", 12.0, 0.1),
    setting("pulse", 0.6, "s", "duration of a throttle or brake pulse", 10.0, 0.05),
    setting("gap", 0.5, "s", "time without throttle and brake between two pulses", 10.0),
    setting("pitch_frequency", 1.4, "Hz", "natural frequency of pitch", 5.0, 0.1),
    setting("pitch_damping", 0.3, "", "damping ratio of pitch", 1.0),
    setting("rate", 100.0, "Hz", "samples a second", 2000.0, 1.0),
    setting("load_noise", 17.0, "N", "white noise of an axle's load", 1000.0),
    setting("acceleration_noise", 0.05, "m/s^2", "white noise of the acceleration", 2.0),
    setting("pitch_rate_noise", 8.7e-4, "rad/s", "white noise of the pitch rate", 0.2),
    setting("speed_noise", 0.03, "m/s", "white noise of the speed", 1.0),
    guess("cg_height", 0.55),
    guess("cg_to_rear", lambda spec, known: known_vehicle(spec, known).values["wheelbase"] / 2),
    guess("pitch_inertia", lambda spec, known: 1.3 * known_vehicle(spec, known).values["mass"]),
)


def _pedals(day: DayRequest) -> tuple[Array, Array]:
    """Time (n,) and acceleration (n,) of the center of gravity: throttle pulses, then brake pulses, random lengths."""
    at, rng = day.at, day.rng
    throttle = [(at["gap"], 0.0), (at["pulse"], at["acceleration_level"])] * PULSES
    brake = [(at["gap"], 0.0), (at["pulse"], -at["braking_level"])] * PULSES
    knots, levels, now = [0.0], [0.0], 0.0
    for hold, level in ((1.0, 0.0), (BUILD_UP, at["acceleration_level"]), *throttle, *brake, (1.0, 0.0)):
        stay = hold * rng.uniform(0.7, 1.3)
        knots += [now + RAMP, now + RAMP + stay]
        levels += [level, level]
        now = knots[-1]
    time = day.clock(now)
    return time, np.interp(time, knots, levels)


def _log(day: DayRequest, k: int) -> Log:
    """The log of one run: the longitudinal force excites the pitch, and the loads balance the moments."""
    at, run = day.at, day.spec.runs[k]
    known = known_vehicle(day.spec, day.known).values  # type: ignore[arg-type]
    time, rate = _pedals(day)
    speed = np.maximum(at["start_speed"] + cumulative_integral(time, rate), 0.5)
    pitch, turn, bend = _pitching(day, time, rate, known["mass"] * at["cg_height"] / at["pitch_inertia"])
    lever = known["antenna_height"] - at["cg_height"]
    motion = {"pitch": pitch, "pitch_rate": turn, "speed": speed, "rolling": rolling_flag(speed)}
    step = float(np.median(np.diff(time)))
    motion["push_speed_rate"] = local_derivative(speed * rate, step, SPAN, 1)
    motion["push_bend"] = local_derivative(rate, step, SPAN)
    unused = {n for n in MOTION if n.startswith(("swing", "push_rate", "acceleration_rate", "pitch_bend"))}
    motion |= dict.fromkeys(unused, np.zeros(time.size))
    true = {**motion, "acceleration": rate - lever * bend}
    front, rear = _loads(day, known, time, {**true, "pitch_acceleration": bend})
    zero = 2**0.5 * getattr(day.spec, "settings").load_zero.value  # noqa: B009
    gravity = GRAVITY * np.sin(pitch) if known["reads_gravity"] else 0.0
    channels = {
        "front_load": day.read(front, "load_noise", zero),
        "rear_load": day.read(rear, "load_noise", zero),
        "acceleration": day.read(true["acceleration"] + gravity, "acceleration_noise"),
        "pitch_rate": day.read(turn, "pitch_rate_noise"),
        "speed": day.read(speed, "speed_noise"),
    }
    return Log(run.log or f"run {k + 1}", time, channels)


def _pitching(day: DayRequest, time: Array, rate: Array, share: float) -> tuple[Array, Array, Array]:
    """Pitch and its first two derivatives (n,): th'' + 2 D w th' + w^2 th = (M h / I) a."""
    from scipy.signal import lsim

    w, damping = 2 * np.pi * day.at["pitch_frequency"], day.at["pitch_damping"]
    drift = np.array([[0.0, 1.0], [-(w**2), -2 * damping * w]])
    _, _, state = lsim((drift, np.array([[0.0], [share]]), np.eye(2), np.zeros((2, 1))), rate, time)
    angle, turn = state.T
    return angle, turn, share * rate - 2 * damping * w * turn - w**2 * angle


def _loads(
    day: DayRequest, known: Mapping[str, float], time: Array, motion: Mapping[str, Array]
) -> tuple[Array, Array]:
    """Front and rear axle loads (n,), N, that balance the moments of the motion and together carry the weight."""
    values = {**dict.fromkeys(ZEROS, 0.0), **known, **{n: day.at[n] for n in SOUGHT}}
    simulator = Simulator(LOAD_TRANSFER, {n: values[n] for n in LOAD_TRANSFER.parameters})
    weight, zeros = known["mass"] * GRAVITY, np.zeros(time.size)
    front, bend = zeros, zeros

    def moment(load: Array) -> Array:
        inputs = {**motion, "front_load": load, "rear_load": weight - load}
        drive = Drive(time, {**inputs, "front_load_bend": bend, "rear_load_bend": -bend}, context={"heading": 0.0})
        seen = simulator(drive, sensitivities=False)
        return np.asarray(sum(seen.outputs[n] for n in MOMENTS))

    for _ in range(LOAD_ROUNDS):
        low, high = moment(zeros), moment(zeros + weight)
        front = -low * weight / (high - low)
        bend = np.gradient(np.gradient(front, time), time)
    return front, weight - front


PLANNED = PlannedDay(
    4,
    SETTINGS,
    lambda day: tuple(_log(day, k) for k in range(len(day.spec.runs))),
    lambda index: {"direction": "back" if index % 2 else "out"},
)
