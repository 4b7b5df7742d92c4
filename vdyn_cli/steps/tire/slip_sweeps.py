"""Logs of slip sweeps: the slip of every sample, and checks of the channels."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.io.clocks.interpolated_values import with_own_samples
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.failure import no_runs
from vdyn_cli.steps.sign_conventions import cosine, wrong_sign
from vdyn_cli.steps.step_policy import STEP_POLICY
from vdyn_cli.steps.tire.spec import TireSettings

FEWEST_SAMPLES = 40  # of a sweep: one bin of binned_sweep
# Share of a sweep's largest loads, by default: tires of a robot carry 100 N, those of a truck 30 kN. The largest begin
# at this quantile: a tire on a rig may be lifted for most of a log.
LEAST_LOAD, LOADED = 0.1, 0.9
SMALL_SLIP = 0.3  # up to which force and slip have the same sign


def slip_sweeps(logs: Sequence[Log], settings: TireSettings, known: Parameters) -> tuple[Log, ...]:
    """The logs with the channel ``slip``, NaN for excluded samples.

    s = om r / V - 1 (SAE J670), where slip is not logged.

    Parameters
    ----------
    logs : force_x, force_z (N), and slip or wheel_speed (rad/s) with vehicle_speed (m/s).
    known : wheel_radius (m), where slip is computed.

    Raises
    ------
    InputError : no log, no slip and no speeds, a sign that contradicts physics, or too few usable samples.
    """
    if not logs:
        raise no_runs("tire")
    if any("slip" not in log and not ("wheel_speed" in log and "vehicle_speed" in log) for log in logs):
        remedy = "map 'wheel_speed' and 'vehicle_speed', or 'slip'"
        raise InputError(Finding("channels", "slip cannot be computed", remedy=remedy))
    sampled = [with_own_samples(log, "vehicle_speed") for log in logs]
    found = tuple(log if "slip" in log else _with_slip(log, settings, known) for log in sampled)
    used = [
        np.isfinite(log["slip"]) & np.isfinite(log["force_x"]) & (log["force_z"] > _least_load(log, settings))
        for log in found
    ]
    raise_all(dict.fromkeys(f for log, use in zip(found, used, strict=True) for f in _doubts(log, int(use.sum()))))
    kept = (np.where(use, log["slip"], np.nan) for log, use in zip(found, used, strict=True))
    return tuple(log.with_channels(slip=slip) for log, slip in zip(found, kept, strict=True))


def _least_load(log: Log, settings: TireSettings) -> float:
    """The load below which a sample is left out, N."""
    own = settings.minimum_load
    return own.value if own else LEAST_LOAD * float(np.nanquantile(log["force_z"], LOADED))


def _with_slip(log: Log, settings: TireSettings, known: Parameters) -> Log:
    known.require("wheel_radius", where="tire")
    speed = log["vehicle_speed"]
    moving = np.abs(speed) > settings.minimum_speed.value
    slip = log["wheel_speed"] * known["wheel_radius"].value / np.where(moving, speed, 1.0) - 1
    return log.with_channels(slip=np.where(moving, slip, np.nan))


def _doubts(log: Log, used: int) -> list[Finding]:
    """The first reason why a sweep with ``used`` usable samples cannot be evaluated; empty where there is none."""
    load, force, slip = log["force_z"], log["force_x"], log["slip"]
    if np.nanmedian(load) < 0:
        what = "Fz is negative; it must be positive on a loaded tire"
        return [wrong_sign(log.name, "force_z", what, f"median {np.nanmedian(load):.0f} N")]
    good = np.isfinite(force) & np.isfinite(slip) & (np.abs(slip) < SMALL_SLIP)
    about = (x[good] - np.mean(x[good]) if good.any() else x for x in (force, slip))  # without zeros
    if np.count_nonzero(good) > FEWEST_SAMPLES and cosine(*about) < -STEP_POLICY.sign_correlation:
        what = "Fx is positive at negative slip; it must be positive when the wheel drives the car"
        return [wrong_sign(log.name, "force_x", what)]
    if used < FEWEST_SAMPLES:
        what = f"fewer than {FEWEST_SAMPLES} samples have speed, load and force"
        remedy = "log faster or sweep slower, or reduce the limits of speed and load under settings"
        return [Finding(log.name, what, f"{used} of {log.time.size} samples", remedy)]
    if np.nanmin(slip) == np.nanmax(slip):
        remedy = "check the sensors of the slip; drive and brake the wheel in a sweep"
        return [Finding(log.name, "the slip is constant", f"{np.nanmin(slip):.3g}", remedy)]
    return []
