"""Which share of a measured slope the drives show, and how late, beside errors of road load and torque."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.inference.bins import cut
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.inference.robust_fits import ordinary_least_squares
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY, NORMAL95
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.drives.segments import total_drive_torque
from vdyn_cli.steps.validate.noise import inertia_of

BIN = 1.0  # s, over which forces are averaged; short compared with the decay of a speed change, about a minute
BLOCK = 20  # bins whose forces count as one in a standard error: gusts and hills last for 5 to 10 s


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
    made, runs = [], len(setup.segments)
    for k in range(runs):
        responses, error, _ = _responses(setup, k, logs, slopes)
        starts = np.zeros((error.size, runs))
        starts[:, k] = responses[:, 0]
        made.append((np.hstack([starts, responses[:, 1:]]), error))
    columns, error = np.vstack([c for c, _ in made]), np.concatenate([e for _, e in made])
    there = np.isfinite(error)
    columns, error = columns[there], error[there]
    share, rest = ordinary_least_squares(columns, error)
    _, without = ordinary_least_squares(columns[:, :-1], error)
    # Without the hill, the simulation is too fast uphill: the error has the sign opposite to that of its response.
    return float(-share[-1]), float(1.0 - np.linalg.norm(rest) / np.linalg.norm(without))


def shown_lag(setup: SimulationSetup, logs: Sequence[Log], slopes: Sequence[Array]) -> tuple[float, float]:
    """The lag of a measured slope behind the hills that the drives show, to first order, and its standard error, s.

    A lag T changes the slope by -T di/dt. The force that the simulation lacks, M (e' + p e) for the error e of its
    speed, is fitted by least squares with those of ``shown_slope`` and with -m g di/dt: the speed's errors accumulate,
    and would be correlated over a minute. With x what is orthogonal to the other forces in -m g di/dt, and r what the
    fit leaves, the standard error is sqrt(sum over blocks of (x'r)^2) / x'x, times the quantile of Student's t for the
    number of blocks over that of a normal distribution; infinite with one block, whose sum the fit makes zero.

    Parameters
    ----------
    setup : mass on a road with the slopes. logs : of its drives. slopes : (n,) of each log, uphill.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    rates = [np.gradient(slope, log.time) for slope, log in zip(slopes, logs, strict=True)]
    made = []
    for k in range(len(setup.segments)):
        responses, error, kept = _responses(setup, k, logs, rates)
        rows = np.column_stack([error, responses[:, 1:]])
        forces = rows[1:] - kept[1:, None] * rows[:-1]
        block = k + np.arange(len(forces)) // BLOCK / len(forces)
        made.append(np.column_stack([block, forces])[np.isfinite(forces[:, 0])])
    block, lacking, others, late = np.split(np.vstack(made), [1, 2, -1], axis=1)
    own = ordinary_least_squares(others, late[:, 0])[1]
    without = ordinary_least_squares(others, lacking[:, 0])[1]
    square = max(float(own @ own), 1e-300)
    lag = float(own @ without) / square
    scores = np.bincount(np.unique(block, return_inverse=True)[1].ravel(), own * (without - lag * own))
    degrees = scores.size - 1
    wider = ((degrees + 1) / degrees) ** 0.5 * t_quantile(degrees) / NORMAL95 if degrees > 0 else np.inf
    # Of a slope that is late, the simulation is too fast where the slope rises.
    return -lag, wider * max(float(np.linalg.norm(scores)), 1e-300) / square


def _responses(
    setup: SimulationSetup, segment: int, logs: Sequence[Log], slopes: Sequence[Array]
) -> tuple[Array, Array, Array]:
    """Responses (b, 6) of a segment's speed to its start and to five forces, and its error (b,), at the ends of bins.

    Also the share (b,) of a change of speed that is left after a bin.
    """
    s, values = setup.segments[segment], setup.prior.values
    error = setup.first[segment].values["speed"] - s.outputs["speed"]
    slope = np.interp(s.time, logs[s.run].time, slopes[s.run])
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
    return np.array(found), bins.mean(error), kept
