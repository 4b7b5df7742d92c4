"""Accelerations of a driven car, and what they depend on."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array, filled
from vdyn_cli.steps.validate.drives.regimes import IDLE, pressed
from vdyn_cli.steps.validate.drives.span_averages import least_over_span, level_rate, mean_over_span, slope_over_span

# Of a drive: time (n,) s; channels speed (m/s, may contain NaN), brake_torque (N m) and, if logged, grade; drive torque
# (n,) N m.
Driven = tuple[Array, Mapping[str, Array], Array]

SLOWEST = 2.0  # m/s, below which tires creep and the car is about to stop
COARSEST = 0.25  # s, spacing of samples above which a second has no slope


@dataclass(frozen=True, eq=False)
class DrivenSamples:
    """Means over a second in which a car is driven without brakes.

    Parameters
    ----------
    time : (n,) s. rate : (n,) m/s^2, acceleration on a level road.
    columns : (n, 4) drive torque T (N m), 1, V^2 (m^2/s^2) and T' (N m/s), on which the rate depends linearly.
    """

    time: Array
    rate: Array
    columns: Array


def driven_samples(time: Array, channels: Mapping[str, Array], torque: Array, step: float) -> DrivenSamples:
    """Samples of a ``Driven`` every ``step`` s of driving; none where a second has no slope."""
    spacing = float(np.median(np.diff(time)))
    if spacing > COARSEST:
        return DrivenSamples(np.zeros(0), np.zeros(0), np.zeros((0, 4)))
    speed = filled(time, channels["speed"])
    driven = (speed > SLOWEST) & ~pressed(time, channels["brake_torque"])
    driven &= least_over_span(time, torque) > IDLE * float(np.max(np.abs(torque), initial=0.0))
    at = np.flatnonzero(driven)[:: max(round(step / spacing), 1)]
    columns = [mean_over_span(time, torque), np.ones(time.size), mean_over_span(time, speed**2)]
    columns.append(slope_over_span(time, torque))
    return DrivenSamples(time[at], level_rate(time, speed, channels)[at], np.column_stack(columns)[at])


def joined(seen: Sequence[DrivenSamples]) -> tuple[Array, Array]:
    """Rates (n,) and columns (n, 4) of all drives, one after another."""
    return np.concatenate([one.rate for one in seen]), np.concatenate([one.columns for one in seen])
