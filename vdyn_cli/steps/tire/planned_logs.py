"""Simulated logs of slip sweeps not driven yet: one wheel driven and braked, each sweep at a different load."""

from __future__ import annotations

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.tire_curve import SHAPE, SLIP_CURVE
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.planned_day import DayRequest, PlannedDay, guess, setting

LOADS = (0.7, 1.35)  # share of the wheel's load, from the first sweep to the last
SETTINGS = (
    setting("speed", 15.0, "m/s", "speed of the vehicle", 80.0, 0.5),
    setting("largest_slip", 0.3, "", "largest slip of a sweep, driven and braked", 1.0, 0.001),
    setting("duration", 12.0, "s", "length of a sweep", 3600.0, 2.0),
    setting("wheel_load", 4000.0, "N", "vertical load of the wheel", 50_000.0, 100.0),
    setting("rate", 100.0, "Hz", "samples a second", 5000.0, 1.0),
    setting("wheel_speed_noise", 0.25, "rad/s", "white noise of the wheel speed (a vibrating tire)", 5.0),
    setting("speed_noise", 0.1, "m/s", "white noise of the vehicle speed", 2.0),
    setting("force_noise", 30.0, "N", "white noise of the forces", 1000.0),
    setting("slip_noise", 0.005, "", "white noise of the slip, where slip is logged", 0.2),
    *(guess(name, value) for name, value in zip(SHAPE, (10.0, 1.9, 1.0, 0.5), strict=True)),
)


def _log(day: DayRequest, k: int) -> Log:
    """Fx = Fz times the magic formula at slip(t) = s sin^3, with a load that oscillates by 2 %."""
    at, n, rng = day.at, len(day.spec.runs), day.rng
    time = day.clock(at["duration"])
    level = at["wheel_load"] * (LOADS[0] + (LOADS[1] - LOADS[0]) * (k / max(n - 1, 1) if n > 1 else 0.46))
    load = level * (1 + 0.02 * np.sin(2 * np.pi * rng.uniform(0.8, 1.6) * time + rng.uniform(0.0, 6.0)))
    slip = at["largest_slip"] * np.sin(2 * np.pi * np.clip((time - 0.5) / (at["duration"] - 1.0), 0.0, 1.0)) ** 3
    shape = {**dict.fromkeys(SLIP_CURVE.parameters, 0.0), **{n: at[n] for n in SHAPE}, "static_load": at["wheel_load"]}
    drive = Drive(
        time, {"slip": slip, "load": load, "elapsed": time, **dict.fromkeys(("swept", "returning", "slip_rate"), 0.0)}
    )
    force = Simulator(SLIP_CURVE, shape)(drive, sensitivities=False).outputs["force_x"]
    channels = {
        "force_x": day.read(force, "force_noise"),
        "force_z": day.read(load, "force_noise"),
        "slip": day.read(slip, "slip_noise"),
        "vehicle_speed": day.read(np.full(time.size, at["speed"]), "speed_noise"),
    }
    if "wheel_radius" in day.known:
        turning = at["speed"] * (1 + slip) / day.known["wheel_radius"].value
        channels["wheel_speed"] = day.read(turning, "wheel_speed_noise")
    return Log(day.spec.runs[k].log or f"sweep {k + 1}", time, channels)


PLANNED = PlannedDay(5, SETTINGS, lambda day: tuple(_log(day, k) for k in range(len(day.spec.runs))))
