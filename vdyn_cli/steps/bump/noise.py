"""Weights of the channels in the fit, from their noise and their residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.bump.crossing import LOADS, Crossing

# Residual over noise above which the residual weights a channel: the noise, from third differences of some hundred
# samples at the bump, has a standard error below 10 %, and an excess of twice that is significant.
MISFIT = 1.2


@dataclass(frozen=True)
class ChannelWeights:
    """The standard deviation that weights each channel.

    Parameters
    ----------
    inflation : by channel, factor on its white noise, 1 or more; its keys are the channels that are fitted.
    rear_weight : the paper's w: the front load's noise weights both loads, and the rear's squares count w times.
        None: each channel is weighted by its own noise.
    """

    inflation: Mapping[str, float]
    rear_weight: float | None = None

    def deviation(self, crossing: Crossing, channel: str) -> float:
        """The standard deviation that weights a channel's rows, in the channel's unit."""
        paper = self.rear_weight is not None and channel == "rear_load"
        noise = crossing.noise["front_load" if paper else channel]
        return noise * self.inflation[channel] / self._emphasis(channel)

    def misfit(self, crossings: Sequence[Crossing], residuals: Sequence[Array]) -> dict[str, float]:
        """Root mean square of each channel's residual over its inflated noise.

        Parameters
        ----------
        residuals : (n,) whitened, of each crossing, channel by channel, without samples that have no reading.
        """
        squares, counts = dict.fromkeys(self.inflation, 0.0), dict.fromkeys(self.inflation, 0)
        for crossing, residual in zip(crossings, residuals, strict=True):
            begin = 0
            for name in self.inflation:
                n = int(np.count_nonzero(np.isfinite(crossing.channels[name])))
                squares[name] += float(np.sum(residual[begin : begin + n] ** 2))
                counts[name] += n
                begin += n
        return {n: float(np.sqrt(squares[n] / max(counts[n], 1))) / self._emphasis(n) for n in self.inflation}

    def mismatch(self, misfit: Mapping[str, float]) -> float:
        """The largest factor by which a weight is wrong; weights are not raised above those of the channels' noise.

        Parameters
        ----------
        misfit : root mean square of the residual over the inflated noise, by channel (``misfit``).
        """
        ratios = [max(m, 1.0 / m) if self.inflation[n] != 1 else m for n, m in misfit.items()]
        return max(ratios)

    def reweighted(self, misfit: Mapping[str, float]) -> ChannelWeights:
        """The weights that correspond to a misfit; with the paper's weighting both loads keep their proportion."""
        inflation = {n: max(1.0, factor * misfit[n]) for n, factor in self.inflation.items()}
        if self.rear_weight is not None:
            inflation |= dict.fromkeys(LOADS, max(inflation[n] for n in LOADS))
        return replace(self, inflation=inflation)

    def _emphasis(self, channel: str) -> float:
        """Root of the paper's w for the rear load."""
        return float(np.sqrt(self.rear_weight)) if self.rear_weight is not None and channel == "rear_load" else 1.0
