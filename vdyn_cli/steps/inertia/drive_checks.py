"""Checks of drives with a wheel force sensor: signs, length, excitation, radius."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import exceeds_noise
from vdyn_cli.io.quality.acceleration_mistake import gain_over_windows
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.physics.models.wheel_spin import INPUTS
from vdyn_cli.quantities.arrays import cumulative_integral
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.inertia.moment_balance import DriveWindows
from vdyn_cli.steps.inertia.policy import INERTIA_POLICY
from vdyn_cli.steps.sign_conventions import cosine, wrong_sign
from vdyn_cli.steps.step_policy import STEP_POLICY

FEWEST_WINDOWS = 12  # of a run: three seconds at the default width of a window
WORK_WINDOW = 1.0  # s, over which work and kinetic energy are compared: ten times the largest clock offset
FEWEST_WORK = 12  # such windows: the correlation of fewer is uncertain by more than 0.3
ROLLING = 5.0  # rad/s of the wheel, above which the ratio of the speeds is accurate enough
EASY = 0.1  # share of the largest torque, below which the tire's slip is negligible
FEWEST_EASY = 50  # samples


def sign_doubts(log: Log) -> list[Finding]:
    """Findings on empty channels, and on channels whose sign contradicts physics.

    The median of load and wheel speed must be positive. Torque, longitudinal force and acceleration, without their
    means, must have positive correlations: below -``sign_correlation`` one of them has the wrong sign, and if torque
    and force rise together, their work must increase the kinetic energy.

    Parameters
    ----------
    log : hub_torque (N m), hub_force_x, hub_force_z (N), wheel_speed (rad/s) and acceleration (m/s^2).
    """
    if empty := empty_channels(log, INPUTS):
        return empty
    findings = []

    def wrong(channel: str, what: str) -> None:
        findings.append(wrong_sign(log.name, channel, what))

    if np.nanmedian(log["hub_force_z"]) < 0:
        wrong("hub_force_z", "the load is negative; it must be positive when the wheel stands on the road")
    if np.nanmedian(log["wheel_speed"]) < 0:
        wrong("wheel_speed", "the wheel speed is negative throughout")
    about = {name: log[name] - np.nanmean(log[name]) for name in INPUTS}
    with_force = cosine(about["hub_torque"], about["hub_force_x"])
    with_acceleration = cosine(about["hub_torque"], about["acceleration"])
    if with_force < -STEP_POLICY.sign_correlation:
        if with_acceleration > 0:
            wrong("hub_force_x", "the force falls where the torque rises; it must be positive when the wheel drives")
        else:
            wrong("hub_torque", "the torque is negative where the wheel drives the car")
    elif with_force > STEP_POLICY.sign_correlation and with_acceleration < -STEP_POLICY.sign_correlation:
        gained = np.gradient(log["wheel_speed"], log.time)
        if cosine(gained - np.nanmean(gained), about["acceleration"]) < 0:
            wrong("acceleration", "the car decelerates where the wheel speeds up")
        else:
            for channel in ("hub_torque", "hub_force_x"):
                wrong(channel, "torque and force are negative where the wheel drives the car")
    elif not findings and with_force > STEP_POLICY.sign_correlation and _energy_falls(log):
        for channel in ("hub_torque", "hub_force_x"):
            wrong(channel, "torque and force are positive where the car slows down")
    return findings


def empty_channels(log: Log, names: Sequence[str]) -> list[Finding]:
    """A finding for each of these channels that has no reading."""
    remedy = "map another column, or leave the run out"
    empty = [name for name in names if not np.isfinite(log[name]).any()]
    return [Finding(f"{log.name}, {name}", "the channel is empty", remedy=remedy) for name in empty]


def _energy_falls(log: Log) -> bool:
    """Whether the work of the hub torque and the change of the wheel's kinetic energy have opposite signs.

    Correlation r of the integral of T om and the change of om^2 over n windows of a second, by its statistic
    t = r sqrt((n - 2)/(1 - r^2)). Clock offsets of a tenth of a window, vibrations and noise hardly change it, whereas
    they hide the correlation of samples.
    """
    torque, speed = log["hub_torque"], log["wheel_speed"]
    good = np.isfinite(torque) & np.isfinite(speed)
    time, turn = log.time[good], speed[good]
    torque = torque[good] - np.median(torque[good])
    edges = np.unique(np.searchsorted(time, np.arange(time[0], time[-1], WORK_WINDOW))) if time.size else np.zeros(0)
    if edges.size <= FEWEST_WORK:
        return False
    work = cumulative_integral(time, torque * turn)
    done, gained = np.diff(work[edges]), np.diff(turn[edges] ** 2)
    alike = cosine(done - done.mean(), gained - gained.mean())
    return bool(alike * np.sqrt((done.size - 2) / max(1.0 - alike**2, 1e-9)) < -INERTIA_POLICY.work_correlation)


def too_little(run: DriveWindows) -> list[Finding]:
    """Findings on a run with fewer than ``FEWEST_WINDOWS`` windows, or with a speed that is constant within noise."""
    remedy = "repeat steps of throttle and brake for half a minute"
    if run.first.size < FEWEST_WINDOWS:
        what = f"has {run.first.size} windows in which the wheel turns and every channel has readings"
        return [Finding(run.log.name, f"{what}: {FEWEST_WINDOWS} are needed", "", remedy)]
    # Of the speed, not its gain in a window: a coarse encoder's noise may hide each gain, but not their sum.
    speed = run.log["wheel_speed"][np.union1d(run.first, run.last)]
    spread = float(np.std(speed)) if np.ptp(speed) else 0.0
    if not exceeds_noise(spread, run.noise.speed, speed.size):
        got = f"standard deviation {spread:.2g} rad/s"
        return [Finding(run.log.name, "the wheel speed is constant within its noise", got, remedy)]
    return []


def radius_contradiction(logs: Sequence[Log], radius: Given) -> tuple[Given, tuple[Finding, ...]]:
    """Comparison of the stated radius, m, with speed over wheel speed at low torque, the rolling radius.

    The lever of the force is the loaded radius, some percent below the rolling one and never above it. One above it by
    more than ``radius_excess`` is doubtful: its standard deviation then includes the difference.

    Returns
    -------
    The radius, and findings on the runs whose rolling radius differs from it.
    """
    rolling = {log.name: found for log in logs if (found := _rolling_radius(log)) is not None}
    high = {name: r for name, r in rolling.items() if r < (1 - INERTIA_POLICY.radius_excess) * radius.value}
    other = {n: r for n, r in rolling.items() if abs(r / radius.value - 1) > INERTIA_POLICY.radius_agreement}
    findings = []
    for name, found in {**other, **high}.items():
        what = "wheel_radius is above the rolling radius, speed over wheel speed: the loaded radius is below it"
        what = what if name in high else "speed over wheel speed is not wheel_radius"
        got = f"{1000 * found:.1f} mm against {1000 * radius.value:.1f} mm"
        remedy = "state the loaded radius, which is the lever of the force"
        findings.append(Finding(name, what, got, remedy, doubt=name in high))
    if len(high) * 2 <= len(rolling):
        return radius, tuple(findings)
    off = radius.value - float(np.median(list(high.values())))
    return replace(radius, std=float(np.hypot(radius.std, off))), tuple(findings)


def contradicted_wheel_speed(logs: Sequence[Log], radius: float) -> tuple[Finding, ...]:
    """A finding on a wheel speed whose change contradicts the acceleration in every run; empty without it.

    Only of logs without ``vehicle_speed``, which is compared with the wheel speed where it is logged. A factor in the
    wheel speed is the same factor in the inertia, and leaves no other trace. Nor where torque over force contradicts
    the radius, which is then wrong and a candidate effect.

    Parameters
    ----------
    radius : of the wheel, m.
    """
    ratios = []
    for log in logs:
        rim = log.with_channels(vehicle_speed=radius * log["wheel_speed"])
        gain, _, _ = gain_over_windows(rim, "vehicle_speed")
        if "vehicle_speed" in log or gain is None or not gain.differs(QUALITY.refused_scale):
            return ()
        force, torque = (log[n] - np.nanmean(log[n]) for n in ("hub_force_x", "hub_torque"))
        if not abs(np.log(np.nansum(force * torque) / np.nansum(force**2) / radius)) < QUALITY.refused_scale:
            return ()
        ratios.append(1.0 / gain.value)
    what = f"wheel_speed * wheel_radius changes {np.median(ratios):.3g} times as fast as the acceleration states"
    remedy = "correct the unit or the pulses per turn of wheel_speed, the unit of acceleration, or wheel_radius"
    return (Finding("wheel_speed", f"{what} in all {len(logs)} runs", remedy=remedy),)


def _rolling_radius(log: Log) -> float | None:
    """Median of speed over wheel speed, m, where the torque is below ``EASY`` of its largest; None without a speed."""
    if "vehicle_speed" not in log:
        return None
    speed, wheel, torque = log["vehicle_speed"], log["wheel_speed"], log["hub_torque"]
    good = np.isfinite(speed) & np.isfinite(torque) & (np.abs(wheel) > ROLLING)
    easy = good & (np.abs(torque) < EASY * np.nanmax(np.abs(torque)))
    return float(np.median(speed[easy] / wheel[easy])) if np.count_nonzero(easy) >= FEWEST_EASY else None
