"""The runs of a campaign, simulated with sensitivities and averaged over the bins."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.fit.campaign import Campaign


@dataclass(frozen=True, eq=False)
class SimulatedRuns:
    """Simulations of the runs; the last one of each is kept, since noise and intervals are computed where a fit ended.

    Parameters
    ----------
    drives : the runs with the slope of an estimated road; empty: as logged.
    """

    campaign: Campaign
    simulator: Simulator
    drives: tuple[Drive, ...] = ()
    _last: dict[int, tuple[list[float], Array, Array]] = field(default_factory=dict, init=False, repr=False)

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
        slopes = (seen.sensitivities[n][:, : theta.size] for n in campaign.channels)
        columns = np.concatenate([campaign.mean(run, s) for s in slopes])
        self._last[run] = values, channels, columns
        return channels, columns
