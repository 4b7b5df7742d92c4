"""Checks of drives with a wheel force sensor: signs, length, excitation, radius."""

from __future__ import annotations

import numpy as np

from vdyn_cli.physics.models.wheel_spin import INPUTS
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.inertia.moment_balance import DriveWindows
from vdyn_cli.steps.sign_conventions import cosine, wrong_sign

FEWEST_WINDOWS = 12  # of a run: three seconds
LEAST_SPIN = 1.0  # rad/s^2, standard deviation of the windows' acceleration, a third of a m/s^2 of the car
CERTAIN = 0.3  # correlation beyond which its sign is certain
ROLLING = 5.0  # rad/s, above which speed over wheel speed means something
EASY = 0.1  # of the largest torque, below which the tire's slip does not matter
FEWEST_EASY = 50  # samples
RADIUS = 0.02  # relative, between rolling and loaded radius


def sign_doubts(log: Log) -> list[Finding]:
    """Empty channels, and channels whose sign contradicts physics."""
    empty = [name for name in INPUTS if not np.isfinite(log[name]).any()]
    if empty:
        return [Finding(f"{log.name}, {name}", "the channel is empty") for name in empty]
    findings = []

    def flip(channel: str, what: str) -> None:
        findings.append(wrong_sign(log.name, channel, what))

    if np.nanmedian(log["hub_force_z"]) < 0:
        flip("hub_force_z", "the load is negative; it must be positive when the wheel stands on the road")
    if np.nanmedian(log["wheel_speed"]) < 0:
        flip("wheel_speed", "the wheel speed is negative throughout")
    about = {name: log[name] - np.nanmean(log[name]) for name in INPUTS}
    with_force = cosine(about["hub_torque"], about["hub_force_x"])
    with_acceleration = cosine(about["hub_torque"], about["acceleration"])
    if with_force < -CERTAIN:
        if with_acceleration > 0:
            flip("hub_force_x", "the force falls where the torque rises; it must be positive when the wheel drives")
        else:
            flip("hub_torque", "the torque is negative where the wheel drives the car")
    elif with_force > CERTAIN and with_acceleration < -CERTAIN:
        gained = np.gradient(log["wheel_speed"], log.time)
        if cosine(gained - np.nanmean(gained), about["acceleration"]) < 0:
            flip("acceleration", "the car brakes where the wheel gains speed")
        else:
            for channel in ("hub_torque", "hub_force_x"):
                flip(channel, "torque and force are negative where the wheel drives the car")
    return findings


def too_little(run: DriveWindows) -> list[Finding]:
    """A run too short, or without changes of speed."""
    remedy = "repeat steps of throttle and brake for half a minute"
    if run.first.size < FEWEST_WINDOWS:
        got = f"{run.first.size} windows with the wheel turning and every channel written"
        return [Finding(run.log.name, "is too short", got, remedy)]
    spin = float(np.std(run.gained / run.duration))
    if spin < LEAST_SPIN:
        got = f"standard deviation of its acceleration {spin:.2g} rad/s^2"
        return [Finding(run.log.name, "the wheel speed is nearly constant", got, remedy)]
    return []


def radius_doubts(log: Log, radius: float) -> list[Finding]:
    """A stated radius (m) far from the rolling one, speed over wheel speed where little torque is transmitted."""
    if "vehicle_speed" not in log:
        return []
    speed, wheel, torque = log["vehicle_speed"], log["wheel_speed"], log["hub_torque"]
    good = np.isfinite(speed) & np.isfinite(torque) & (np.abs(wheel) > ROLLING)
    easy = good & (np.abs(torque) < EASY * np.nanmax(np.abs(torque)))
    if np.count_nonzero(easy) < FEWEST_EASY:
        return []
    rolling = float(np.median(speed[easy] / wheel[easy]))
    if abs(rolling / radius - 1) < RADIUS:
        return []
    what = "speed over wheel speed is not wheel_radius"
    got = f"{1000 * rolling:.1f} mm against {1000 * radius:.1f} mm"
    return [Finding(log.name, what, got, "the lever of the force is the loaded radius; check which one is given")]
