"""Checks of a validation: integration step, sample spacing, and whether the torque belongs to the speed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import filled, rms
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.drives.segments import MOVING, DriveSegment, total_drive_torque
from vdyn_cli.steps.validate.policy import VALIDATE_POLICY
from vdyn_cli.steps.validate.prediction_band import PredictionBand

LONGEST_STEP = 0.002  # s: half-shafts and wheels oscillate at up to 540 rad/s; their torque is then 4 % off
BLOCK = 4.0  # s, of the means: shorter ones are noisy for a speed at 1 Hz, in longer ones the driver has corrected


def refuse_coarse(model: str, step: float) -> None:
    """Refuse an integration step (s) that is too long for the full vehicle.

    Raises
    ------
    InputError : the step is longer than ``LONGEST_STEP``.
    """
    if model == "vehicle" and step > LONGEST_STEP:
        what = f"is longer than {1e3 * LONGEST_STEP:g} ms, beyond which the vehicle's half-shafts are not accurate"
        raise InputError(Finding("settings.step", what, f"{1e3 * step:g} ms", "leave it out"))


def missed_drives(setup: SimulationSetup, least: float = VALIDATE_POLICY.missed_error) -> tuple[Finding, ...]:
    """A finding for each drive whose simulated speed is far off, with a remedy.

    rms(V_simulated - V_measured) > least max(|V_measured|), over all segments of the log, since one segment may have an
    unlogged input. A diagnosis still follows: a wrong unit, motor constant or mass causes errors of this size.

    Parameters
    ----------
    setup : simulated with its effects at their start values. least : share of the largest speed.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    found = []
    logs = [s.log for s in setup.segments]
    for log in dict.fromkeys(logs):
        own = [k for k, name in enumerate(logs) if name == log]
        speeds = [setup.segments[k].outputs["speed"] for k in own]
        errors = [setup.first[k].values["speed"] - speed for k, speed in zip(own, speeds, strict=True)]
        largest = max(max(float(np.nanmax(np.abs(v))) for v in speeds), MOVING)
        miss = float(np.sqrt(np.nanmean(np.concatenate(errors) ** 2))) / largest
        if miss > least:
            worst = own[int(np.argmax([np.nansum(e**2) for e in errors]))]
            found.append(_missed_drive([setup.segments[k] for k in own], setup.segments[worst], miss))
    return tuple(found)


def beyond_band(found: Sequence[Mapping[str, PredictionBand]]) -> bool:
    """Whether the rms error of the speed exceeds the standard deviation by parameters and sensor ``missed_std`` times.

    Parameters
    ----------
    found : prediction bands of every segment. Their gusts are ignored, since these are estimated from the error.
    """
    error = np.concatenate([one["speed"].error for one in found])
    allowed = np.concatenate([np.hypot(one["speed"].own, one["speed"].sensor) for one in found])
    there = np.isfinite(error)
    return rms(error[there]) > VALIDATE_POLICY.missed_std * rms(allowed[there])


def torque_correlation(segments: Sequence[DriveSegment]) -> float:
    """Correlation of the drive torque with the car's acceleration, of means over ``BLOCK``, at equal speed.

    Both minus their least-squares fits by 1, v and v^2, which contain the road load. The torque of the same drive is
    correlated with the acceleration for any hills, mass and channel scales. NaN where torque or speed is constant.
    """
    found = []
    for s in segments:
        speed, bins = filled(s.time, s.outputs["speed"]), cut(s.time, BLOCK)
        channels = speed, np.gradient(speed, s.time), total_drive_torque(s.inputs)
        found.append(np.column_stack([bins.mean(v) for v in channels]))
    speed, *both = np.vstack(found).T
    load = np.column_stack([np.ones_like(speed), speed, speed**2])
    rate, torque = (ordinary_least_squares(load, v)[1] for v in both)
    size = float(np.linalg.norm(rate) * np.linalg.norm(torque))
    return float(rate @ torque) / size if size > 0 else float("nan")


def is_long_trip(segments: Sequence[DriveSegment]) -> bool:
    """Whether a drive is longer than ``long_trip``, and in every drive the acceleration follows the torque."""
    drives = [[s for s in segments if s.log == log] for log in dict.fromkeys(s.log for s in segments)]
    own = all(torque_correlation(one) > VALIDATE_POLICY.own_torque for one in drives)
    return own and max(one[-1].time[-1] - one[0].time[0] for one in drives) > VALIDATE_POLICY.long_trip


def _missed_drive(segments: Sequence[DriveSegment], worst: DriveSegment, miss: float) -> Finding:
    """The finding on a drive of these segments; ``worst`` is the one with the largest error."""
    several = len(segments) > 1
    name, _, times = worst.name.rpartition(", ") if several else (worst.name, "", "")
    correlation = torque_correlation(segments)
    follows, remedy = "", "check unit, gear_ratio, brake_torque and grade"
    if correlation < -VALIDATE_POLICY.own_torque:
        remedy = (
            "positive torque slows the car here: add 'sign: -1' to drive_torque, or remove it if it is there; or, if "
            "the column is the torque of the brakes, map it as brake_torque and another one as drive_torque"
        )
    elif correlation > VALIDATE_POLICY.own_torque:
        follows = f", although the acceleration follows it (correlation {correlation:.2f})"
        remedy = (
            "a force or a scale is missing or wrong: map grade and brake_torque, check road load, mass and gear_ratio; "
            "check also that torque and speed belong to one drive and one clock"
        )
    else:
        remedy = f"check that torque and speed belong to one drive and one clock, then {remedy}"
    where = f", most of it from {times}" if several else ""
    off = f"the simulated speed is off by {100 * miss:.0f} % rms of the largest speed{where}"
    return Finding(
        f"{name}, channel 'drive_torque'", f"does not produce this speed{follows}: {off}", "", remedy, doubt=True
    )
