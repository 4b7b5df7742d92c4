"""The measured channels of one run, and the whitened residuals of a simulation of it (output error)."""

from __future__ import annotations

from collections.abc import Callable, Mapping
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
    whitened : whitens errors (n, channels, k) where their noise is not white; None: divides by ``deviation``.
    """

    time: Array
    values: Mapping[str, Array]
    deviation: Mapping[str, float]
    whitened: Callable[[Array], Array] | None = None

    def residual(self, simulated: Simulated, zeros: Array) -> Array:
        """(simulated + zero - measured) / deviation, (rows,), channel by channel; ``zeros`` : of each channel."""
        return self._weighted(self._errors(simulated, zeros)[:, :, None])[:, 0]

    def rows(self, simulated: Simulated, zeros: Array, scale: Array) -> Rows:
        """The residuals with their derivatives by the simulated unknowns (k,), then by the zeros.

        Parameters
        ----------
        simulated : with sensitivities to k unknowns in SI. scale : (k,), SI units per unit of each.
        """
        slopes = np.zeros((self.time.size, zeros.size, scale.size + zeros.size + 1))
        for place, name in enumerate(self.values):
            slopes[:, place, : scale.size] = simulated.sensitivities[name] * scale
            slopes[:, place, scale.size + place] = 1.0
        slopes[:, :, -1] = self._errors(simulated, zeros)
        weighted = self._weighted(slopes)
        times = [self.time[np.isfinite(x)] for x in self.values.values()]
        return Rows(weighted[:, -1], weighted[:, :-1], time=np.concatenate(times))

    def _errors(self, simulated: Simulated, zeros: Array) -> Array:
        """Simulated + zero - measured, (n, channels)."""
        errors = [simulated.outputs[n] + zero - x for (n, x), zero in zip(self.values.items(), zeros, strict=True)]
        return np.stack(errors, axis=1)

    def _weighted(self, errors: Array) -> Array:
        """Whitened errors (rows, k), channel by channel, of errors (n, channels, k)."""
        good = np.stack([np.isfinite(x) for x in self.values.values()])
        if self.whitened is None:
            weighted = errors / np.array(list(self.deviation.values()))[:, None]
        else:
            weighted = self.whitened(np.where(good.T[:, :, None], errors, 0.0))
        return np.asarray(np.concatenate([weighted[seen, place] for place, seen in enumerate(good)]))
