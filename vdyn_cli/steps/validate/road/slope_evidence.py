"""Which share of a measured slope the drives show, beside errors of road load and torque."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.drives.segments import DriveSegment, total_drive_torque
from vdyn_cli.steps.validate.noise import inertia_of

BIN = 1.0  # s, over which forces are averaged; short compared with the decay of a speed change, about a minute


def shown_slope(setup: SimulationSetup, logs: Sequence[Log], slopes: Sequence[Array]) -> tuple[float, float]:
    """The share of a measured slope that the drives show, and by which share it reduces the rms error of the speed.

    A small force x(t) changes the speed by S with S' = x / M - p S, p = rho c A v / M. The error of the speed is
    fitted by least squares with the responses to x = 1, v, v^2 and the drive torque (errors of road load, mass and
    torque) and to every segment's start, without and with the response to x = -m g slope.

    Parameters
    ----------
    setup : mass on a road without these slopes. logs : of its drives. slopes : (n,) of each log, uphill.

    Returns
    -------
    The fitted share of the slope: 1 as measured, -1 with the wrong sign; and 1 - rms with / rms without.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    values, made = setup.prior.values, []
    for k, s in enumerate(setup.segments):
        slope = np.interp(s.time, logs[s.run].time, slopes[s.run])
        responses, error = _responses(s, setup.first[k].values["speed"] - s.outputs["speed"], slope, values)
        starts = np.zeros((error.size, len(setup.segments)))
        starts[:, k] = responses[:, 0]
        made.append((np.hstack([starts, responses[:, 1:]]), error))
    columns, error = np.vstack([c for c, _ in made]), np.concatenate([e for _, e in made])
    there = np.isfinite(error)
    columns, error = columns[there], error[there]
    share, rest = ordinary_least_squares(columns, error)
    _, without = ordinary_least_squares(columns[:, :-1], error)
    # Without the hill, the simulation is too fast uphill: the error has the sign opposite to that of its response.
    return float(-share[-1]), float(1.0 - np.linalg.norm(rest) / np.linalg.norm(without))


def _responses(s: DriveSegment, error: Array, slope: Array, values: Mapping[str, float]) -> tuple[Array, Array]:
    """Responses (b, 6) of the speed to its start and to five forces, and its error (b,), both at the ends of bins."""
    bins, inertia = cut(s.time, BIN), inertia_of(values)
    speed = bins.mean(s.inputs["speed"] if "speed" in s.inputs else np.nan_to_num(s.outputs["speed"]))
    torque = bins.mean(total_drive_torque(s.inputs)) * values.get("gear_ratio", 1.0) / values["wheel_radius"]
    climb = -GRAVITY * values["mass"] * bins.mean(slope)
    forces = np.column_stack([np.zeros_like(speed), np.ones_like(speed), speed, speed**2, torque, climb]) / inertia
    kept = np.exp(-values["air_density"] * values["drag_area"] * np.maximum(speed, 0.0) / inertia * bins.width)
    state, found = np.eye(6)[0], []
    for force, share, width in zip(forces, kept, bins.width, strict=True):
        state = share * state + width * force
        found.append(state)
    return np.array(found), bins.mean(error)
