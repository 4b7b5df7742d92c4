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
        lags = len(self.prewhitener.weights)
        used = np.convolve(self.shown, np.ones(lags + 1))[lags:] > 0.5  # the rows shown and those that predict them
        near = np.flatnonzero(used)
        part = p.part[near] + np.cumsum(np.diff(near, prepend=near[:1]) > 1)  # a new one after each gap
        whole = self.prewhitener.whole(part)
        shown = self.shown[near[whole]]
        rows = self.prewhitener.white(_oscillating(p, values, near), part)
        return p.time[near[whole[shown]]], rows[shown]


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
    return ShaftOscillation(shown, prewhitener(_oscillating(p, perturbed, np.arange(p.time.size)), LAGS))


def _oscillating(p: RowLayout, values: Mapping[str, Array], at: NDArray[np.intp]) -> Array:
    """Torques (r, shafts, ...) minus their means over each fast row, in units of their sensors' noise.

    Parameters
    ----------
    at : (r,) indices of the kept samples.
    """
    row = np.repeat(np.arange(p.fine.count.size), p.fine.count)[at]
    columns = []
    for name in p.others:
        kept = values[name][p.keep]
        columns.append((kept[at] - p.fine.mean(kept)[row]) / p.levels[name])
    return np.stack(columns, axis=1)
