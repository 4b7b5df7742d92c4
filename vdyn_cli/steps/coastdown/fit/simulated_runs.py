"""The runs of a campaign, simulated with sensitivities and averaged over the bins."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Drive, Simulator, sensitive_to
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.fit.campaign import Campaign


@dataclass(frozen=True, eq=False)
class SimulatedRuns:
    """Simulations of the runs; the last one of each is kept, since noise and intervals are computed where a fit ended.

    Parameters
    ----------
    drives : the runs with the slope of an estimated road; empty: as logged.
    columns : indices of the unknowns to which derivatives are simulated; None: all.
    """

    campaign: Campaign
    simulator: Simulator
    drives: tuple[Drive, ...] = ()
    columns: NDArray[np.intp] | None = None
    _last: dict[int, tuple[list[float], Array, Array]] = field(default_factory=dict, init=False, repr=False)

    def sensitive_to(self, names: Collection[str]) -> SimulatedRuns:
        """The same runs without derivatives (zeros) to other unknowns than these."""
        unknowns = self.simulator.unknowns
        fitted = len(unknowns) - 2 + self.campaign.speed_fitted
        columns = np.array([i for i, n in enumerate(unknowns[:fitted]) if n in names], dtype=np.intp)
        simulator = sensitive_to(self.simulator, [unknowns[i] for i in columns])
        return replace(self, simulator=simulator, columns=columns)

    def binned(self, run: int, theta: Array, wind_variance: float) -> tuple[Array, Array]:
        """The channels of one run (m,) and their derivatives (m, k).

        Parameters
        ----------
        theta : (k,), the shared unknowns of the simulation, then the start speed if it is fitted.
        wind_variance : m^2/s^2.
        """
        campaign = self.campaign
        shared = theta.size - campaign.speed_fitted
        start = theta[-1] if campaign.speed_fitted else campaign.runs[run].speed[0]
        values = [*theta[:shared].tolist(), float(start), wind_variance]
        last = self._last.get(run)
        if last is not None and last[0] == values:
            return last[1:]
        try:
            seen = self.simulator(self.drives[run] if self.drives else campaign.fit_drives[run], values)
        except ResultError as error:  # far from the solution the simulation may be unstable
            raise ArithmeticError(str(error)) from error
        channels = np.concatenate([campaign.mean(run, seen.outputs[n]) for n in campaign.channels])
        columns = np.zeros((channels.size, theta.size))
        at = np.arange(theta.size) if self.columns is None else self.columns
        slopes = (seen.sensitivities[n][:, : at.size] for n in campaign.channels)
        columns[:, at] = np.concatenate([campaign.mean(run, s) for s in slopes])
        self._last[run] = values, channels, columns
        return channels, columns
