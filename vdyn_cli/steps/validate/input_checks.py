"""Checks before a validation: integration step, sample spacing, and whether the torque belongs to the speed."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.segments import DriveSegment, driving
from vdyn_cli.steps.validate.simulation import SimulationSetup

LONGEST_STEP = 0.002  # s: the vehicle's half-shafts and wheels turn at up to 540 rad/s; 4 % of error in their torque
SPARSE = 2.0  # s between samples
UNIT = "check the unit of time: milliseconds?"
FOREIGN = 0.12  # rms error of the speed over its largest value, larger than with any torque of the same drive


def refuse_coarse(model: str, step: float) -> None:
    """Refuse a step (s) at which the full vehicle is not accurate.

    Raises
    ------
    InputError : the step is longer than ``LONGEST_STEP``.
    """
    if model == "vehicle" and step > LONGEST_STEP:
        what = f"is longer than {1e3 * LONGEST_STEP:g} ms, beyond which the vehicle's half-shafts are not accurate"
        raise InputError(Finding("settings.step", what, f"{1e3 * step:g} ms", "leave it out"))


def refuse_sparse(logs: Sequence[Log]) -> None:
    """Refuse logs whose samples are too far apart to simulate a drive.

    Raises
    ------
    InputError : all of them.
    """
    usual = [float(np.median(np.diff(log.time))) if log.time.size > 1 else 0.0 for log in logs]
    raise_all(
        Finding(f"{log.name}, channel 'time'", "has samples too far apart to simulate a drive", f"{step:.3g} s", UNIT)
        for log, step in zip(logs, usual, strict=True)
        if step > SPARSE
    )


def refuse_foreign(setup: SimulationSetup) -> None:
    """Refuse drives whose torque does not explain the measured speed at all.

    Raises
    ------
    InputError : all of them, each with a remedy.
    """
    problems = []
    for k, s in enumerate(setup.segments):
        simulated = setup.first[k].values["speed"]
        measured = s.outputs["speed"]
        miss = float(np.sqrt(np.nanmean((simulated - measured) ** 2))) / max(float(np.nanmax(np.abs(measured))), 1.0)
        if miss > FOREIGN:
            problems.append(_foreign(s, miss))
    raise_all(problems)


def _foreign(s: DriveSegment, miss: float) -> Finding:
    what = f"does not drive this speed: the simulation misses it by {miss:.0%} of its largest value"
    remedy = (
        "check that torque and speed belong to one drive and one clock, then check unit, gear_ratio, "
        "brake_torque and grade"
    )
    torque = driving(s.inputs)
    speed = s.outputs["speed"]
    there = np.isfinite(speed)
    rate = np.gradient(np.interp(s.time, s.time[there], speed[there]), s.time)
    if np.ptp(torque) > 0 and np.corrcoef(torque, rate)[0, 1] < -0.2:
        remedy = "positive torque slows the car here: add 'sign: -1' to the channel drive_torque"
    return Finding(f"{s.name}, channel 'drive_torque'", what, "", remedy)
