"""Errors of the simulated speed at the ends of short windows of long trips."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives
from vdyn_cli.steps.validate.road.open_road import over_drives


@dataclass(frozen=True, eq=False)
class WindowEnds:
    """End errors of windows, simulated minus measured end speed, m/s.

    Parameters
    ----------
    names : of the trips. run : (n,) index of each window's trip. error : (n,). length : s, of a window.
    mean, interval95 : of the trips' means. Trips are the independent units, since windows of one share wind and tires.
    own : standard deviation of the mean by the parameters' uncertainty.
    """

    names: tuple[str, ...]
    run: NDArray[np.int64]
    error: Array
    length: float
    mean: float
    interval95: tuple[float, float]
    own: float

    @property
    def units(self) -> int:
        """Number of trips."""
        return int(np.unique(self.run).size)


def window_ends(w: WhitenedDrives, names: tuple[str, ...]) -> WindowEnds:
    """The end error of every segment, m/s, and their mean with a 95 % interval from the scatter between trips.

    Parameters
    ----------
    w : the drives, simulated at the start values, cut into windows.
    names : of the trips, by run number.
    """
    setup = w.setup
    run = np.array([s.run for s in setup.segments])
    error = np.array([o.values["speed"][-1] - s.end[0] for o, s in zip(setup.first, setup.segments, strict=True)])
    slopes = np.array([o.sensitivities["speed"][-1, : len(setup.prior.names)] for o in setup.first])
    share = np.array([1.0 / np.sum(run == u) for u in run])
    moved = share @ slopes / share.sum() @ setup.prior.root
    length = float(np.median([s.duration for s in setup.segments]))
    mean = over_drives(np.array([error[run == u].mean() for u in np.unique(run)]))
    return WindowEnds(names, run, error, length, mean.value, mean.interval95, float(np.linalg.norm(moved)))
