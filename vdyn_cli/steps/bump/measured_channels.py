"""The measured channels of one run, and the whitened residuals of a simulation of it (output error)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.simulate import Simulated
from vdyn_cli.inference import Rows
from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class MeasuredChannels:
    """Channels with the standard deviations that weight them; a sample without a reading, NaN, gives no row.

    Parameters
    ----------
    time : (n,) s. values : each (n,). deviation : of each channel, in its unit.
    """

    time: Array
    values: Mapping[str, Array]
    deviation: Mapping[str, float]

    def residual(self, simulated: Simulated, zeros: Array) -> Array:
        """(simulated + zero - measured) / deviation, (rows,), channel by channel; ``zeros`` : of each channel."""
        parts = []
        for (name, measured), zero in zip(self.values.items(), zeros.tolist(), strict=True):
            good = np.isfinite(measured)
            parts.append((simulated.outputs[name][good] + zero - measured[good]) * (1.0 / self.deviation[name]))
        return np.concatenate(parts)

    def rows(self, simulated: Simulated, zeros: Array, scale: Array) -> Rows:
        """The residuals with their derivatives by the simulated unknowns (k,), then by the zeros.

        Parameters
        ----------
        simulated : with sensitivities to k unknowns in SI. scale : (k,), SI units per unit of each.
        """
        jacobians, times = [], []
        for place, (name, measured) in enumerate(self.values.items(), start=scale.size):
            good = np.isfinite(measured)
            weight = 1.0 / self.deviation[name]
            jacobian = np.zeros((int(np.count_nonzero(good)), scale.size + zeros.size))
            jacobian[:, : scale.size] = simulated.sensitivities[name][good] * (weight * scale)
            jacobian[:, place] = weight
            jacobians.append(jacobian)
            times.append(self.time[good])
        return Rows(self.residual(simulated, zeros), np.concatenate(jacobians), time=np.concatenate(times))
