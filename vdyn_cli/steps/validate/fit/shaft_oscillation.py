"""Rows of the half-shafts' torque while these oscillate, in the second after the drive torque changes.

At other times, the noise of the torque sensor excites the simulated shafts more than the road does, which would bias a
fit towards more damping. After a tip-in the oscillation is many times larger than that.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.drives.segments import DriveSegment, total_drive_torque
from vdyn_cli.steps.validate.fit.residual_rows import Prewhitener, RowLayout, prewhitener

RAMP = 0.3  # s over which a change of the torque is measured
CLEAR = 30.0  # noise levels of the torque, least change that excites the shafts
AFTER = 0.8  # s after a change in which the shafts oscillate
LAGS = 10  # rows from which the noise of the torque sensor is predicted


@dataclass(frozen=True, eq=False)
class ShaftOscillation:
    """Mask ``shown`` (m,) of the kept samples with an oscillation, and the prewhitening of their noise."""

    shown: NDArray[np.bool_]
    prewhitener: Prewhitener

    def white(self, p: RowLayout, values: Mapping[str, Array]) -> tuple[Array, Array]:
        """Times (r,) and whitened rows (r, shafts, ...) of the shafts' torque minus its mean over each fast row."""
        rows, whole = self.prewhitener.white(_oscillating(p, values), p.part), self.prewhitener.whole(p.part)
        shown = self.shown[whole]
        return p.time[whole][shown], rows[shown]


def shaft_oscillation(
    s: DriveSegment, p: RowLayout, denoised: Mapping[str, Array], perturbed: Mapping[str, Array], level: float
) -> ShaftOscillation | None:
    """The rows of a segment; None if no half-shaft's torque is measured, rows are not averaged, or none oscillates.

    Parameters
    ----------
    denoised : torques of the simulation. perturbed : change of the outputs by additional noise of the torque.
    level : N m, white noise of a sample of the drive torque.
    """
    if not p.others or p.fine.count.max() < 2:
        return None
    torque = total_drive_torque(denoised)
    half = RAMP / 2
    change = np.abs(np.interp(s.time + half, s.time, torque) - np.interp(s.time - half, s.time, torque))
    at = s.time[change > CLEAR * level]
    last = np.searchsorted(at, p.time, side="right") - 1
    shown = (last >= 0) & (p.time - at[np.maximum(last, 0)] < AFTER) if at.size else np.zeros(p.time.size, dtype=bool)
    if np.count_nonzero(shown) < 2 * LAGS:
        return None
    return ShaftOscillation(
        shown, prewhitener(_oscillating(p, {n: v[:, None] for n, v in perturbed.items()})[:, :, 0], LAGS)
    )


def _oscillating(p: RowLayout, values: Mapping[str, Array]) -> Array:
    """Torques (m, shafts, ...) minus their means over each fast row, in units of their sensors' noise."""
    columns = []
    for name in p.others:
        kept = values[name][p.keep] / p.levels[name]
        columns.append(kept - np.repeat(p.fine.mean(kept), p.fine.count, axis=0))
    return np.stack(columns, axis=1)
