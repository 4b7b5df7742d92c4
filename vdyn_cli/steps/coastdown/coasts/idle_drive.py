"""A measured drive that stays at zero: with it, runs in neutral are coast-downs, and are evaluated as such."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.physics.models.road_load import DriveSignal
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.coastdown.coasts.segments import FEWEST_SAMPLES
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

PIECE = 10.0  # s, over which the drive is averaged: a driver's action on the pedal lasts that long or is braked again

IDLE_DRIVES = ("channels.drive_torque", "channels.drive_force")  # places of the note


def is_idle(logs: Sequence[Log], drive: DriveSignal, known: Mapping[str, Given]) -> bool:
    """Whether the drive of every log is zero, over the whole log and over each of its ``PIECE``.

    Zero is a mean force F with |F| <= max(a m_e (V_max - V_min)/T, b s/sqrt(n)): the share a
    (``material_run_force``) of the mean resistance while the speed falls, or b (``idle_drive``) standard errors of the
    n samples, whose white noise s is that of their differences.

    Parameters
    ----------
    drive : "torque" or "force". known : mass and rotating_mass, for torque also gear_ratio and wheel_radius; SI.
    """
    gain = per_inertia(drive, known)
    return all(_is_zero(log, gain * log[f"drive_{drive}"]) for log in logs)


def per_inertia(drive: DriveSignal, known: Mapping[str, Given]) -> float:
    """Acceleration per unit of the drive without losses: i/(r m_e) in 1/(kg m) of a torque, 1/m_e in 1/kg of a force.

    Parameters
    ----------
    known : mass and rotating_mass, for a torque also gear_ratio and wheel_radius; SI.
    """
    inertia = known["mass"].value + known["rotating_mass"].value
    return (known["gear_ratio"].value / known["wheel_radius"].value if drive == "torque" else 1.0) / inertia


def _is_zero(log: Log, pushed: Array) -> bool:
    """Whether the acceleration by the drive, (n,) m/s^2, is zero throughout."""
    good = np.isfinite(pushed) & np.isfinite(log["speed"])
    if np.count_nonzero(good) < FEWEST_SAMPLES:
        return False
    time, speed, pushed = log.time[good], np.abs(log["speed"][good]), pushed[good]
    material = COASTDOWN_POLICY.material_run_force * float(np.ptp(speed)) / max(float(np.ptp(time)), 1e-9)
    noise = float(np.sqrt(0.5 * np.mean(np.diff(pushed) ** 2)))
    pieces = cut(time, PIECE)
    means, counts = np.r_[pieces.mean(pushed), pushed.mean()], np.r_[pieces.count, pushed.size]
    limits = np.maximum(material, COASTDOWN_POLICY.idle_drive * noise / np.sqrt(counts))
    return bool(speed[0] > speed[-1] and np.all(np.abs(means) <= limits))


def idle_finding(drive: DriveSignal, logs: Sequence[Log]) -> Finding:
    """The note that a mapped drive is zero and therefore not used."""
    unit, values = ("N m" if drive == "torque" else "N"), [log[f"drive_{drive}"] for log in logs]
    mean, spread = (float(np.nanmean([f(v) for v in values])) for f in (np.nanmean, np.nanstd))
    what = (
        f"drive_{drive} is zero within its noise in all runs ({mean:.2g} {unit} on average, {spread:.2g} {unit} rms "
        "noise): the runs are evaluated as coast-downs, without this channel"
    )
    return Finding(f"channels.drive_{drive}", what)
