"""Noise of the hub torque from the scatter of its impulses between windows, which exceeds that of its samples."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference import white_level
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.inertia.moment_balance import DriveWindows, impulses

THIRD_OF_DIFFERENCES = 3.5  # var(d3 (w_k+1 - w_k)) / 20 of white noise w: 70 / 20
# Least relative excess of the variance over that of the samples' noise, in units of (2 / n)^0.5: two standard errors of
# a variance from the median of overlapping third differences.
LEAST_EXCESS = 5.0
FEWEST = 16  # windows of a run
TINY = 1e-12  # (rad/s)^2


def with_scatter(runs: Sequence[DriveWindows], wheel: Mapping[str, float]) -> tuple[DriveWindows, ...]:
    """The runs with the noise of their torque estimated from the scatter of impulses, where that is larger.

    Torque and forces of a rolling wheel have noise that is correlated between samples: the tire is uneven, the road
    rough, the amplifiers have filters. Third differences of

        e = impulse - J gained,    var(d3 e) / 20 = f^2 S_T + (m r)^2 S_a + 3.5 J^2 speed^2,

    suppress slow changes, such as most model errors; J is estimated from them, and their median suppresses pedal steps.
    S_T and S_a are the variances by the white noise of the samples of torque and acceleration, m r is the wheel's mass
    times radius, and f one factor for all runs, which have the same sensors. If the torque's noise were underestimated
    relative to the speed's, the inertia would be biased high (total least squares).

    Parameters
    ----------
    wheel : wheel_mass (kg), wheel_radius (m), rolling_resistance; empty for a free wheel.
    """
    moment = wheel.get("wheel_mass", 0.0) * wheel.get("wheel_radius", 0.0)
    whitened: list[Array] = []
    of_torque: list[float] = []
    for run in runs:
        torque = impulses(run, wheel)
        if torque.size < FEWEST or not np.isfinite(torque).all():
            continue
        change, effort = np.diff(run.gained, 3), np.diff(torque, 3)
        inertia = float(change @ effort / max(float(change @ change), TINY))
        sampled = (run.noise.torque * float(np.median(run.noise.spread))) ** 2
        of_car = moment**2 * float(np.median(run.noise.carried))
        usual = sampled + of_car + THIRD_OF_DIFFERENCES * (inertia * run.noise.speed) ** 2
        whitened.append((torque - inertia * run.gained) / usual**0.5)
        of_torque.append(sampled / usual)
    count = sum(e.size for e in whitened)
    excess = white_level(np.concatenate(whitened)) ** 2 - 1.0 if whitened else 0.0
    if not excess > LEAST_EXCESS * (2.0 / max(count, 1)) ** 0.5:
        return tuple(runs)
    factor = float((1.0 + excess / np.mean(of_torque)) ** 0.5)
    return tuple(replace(run, noise=replace(run.noise, torque=factor * run.noise.torque)) for run in runs)
