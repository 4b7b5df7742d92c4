"""Short stretches of long trips: how far the simulated speed has run away when each ends."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.result import Table
from vdyn_cli.steps.validate.regression import Weighed

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Ends:
    """End errors of windows, simulated less measured end speed, m/s.

    Parameters
    ----------
    run : (n,) which trip a window is from. error : (n,). length : s, of a window.
    mean, interval95 : of the trips' means. Trips are the independent units: windows of one share its wind and tires.
    own : standard deviation that the parameters' uncertainty gives to the mean.
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
        return int(np.unique(self.run).size)


def ends(w: Weighed, names: tuple[str, ...]) -> Ends:
    """The end error of every stretch, and their mean with an interval over trips."""
    trial = w.trial
    run = np.array([s.run for s in trial.stretches])
    error = np.array([o.values["speed"][-1] - s.end[0] for o, s in zip(w.first, trial.stretches, strict=True)])
    slopes = np.array([o.slopes["speed"][-1, : len(trial.beliefs.names)] for o in w.first])
    share = np.array([1.0 / np.sum(run == u) for u in run])
    moved = share @ slopes / share.sum() @ trial.beliefs.root
    length = float(np.median([s.duration for s in trial.stretches]))
    means = np.array([error[run == u].mean() for u in np.unique(run)])
    return Ends(names, run, error, length, float(means.mean()), _over_units(means), float(np.linalg.norm(moved)))


def _over_units(means: Array) -> tuple[float, float]:
    """95 % interval of the mean of the trips' means."""
    if means.size < 2:
        return float("-inf"), float("inf")
    half = t_quantile(means.size - 1.0) * float(means.std(ddof=1)) / float(np.sqrt(means.size))
    return float(means.mean()) - half, float(means.mean()) + half


def table(found: Ends) -> Table:
    """One row a trip."""
    rows = []
    for u in np.unique(found.run):
        e = found.error[found.run == u]
        spread = f"{e.std(ddof=1):.2f}" if e.size > 1 else ""
        rows.append(
            (found.names[u].rpartition("/")[2], f"{e.size}", f"{e.mean():+.2f}", spread, f"{np.mean(e > 0):.0%}")
        )
    low, high = found.interval95
    e = found.error
    every = f"{np.mean(e > 0):.0%}"
    rows.append(("all windows alike", f"{e.size}", f"{e.mean():+.2f}", f"{e.std(ddof=1):.2f}", every))
    rows.append(("all trips alike", "", f"{found.mean:+.2f} ({low:+.2f} to {high:+.2f})", "", ""))
    return Table(
        "window_ends",
        f"End speed of {found.length:.0f} s windows, simulated less measured",
        ("trip", "windows", "mean [m/s]", "scatter [m/s]", "too fast"),
        tuple(rows),
        "Each window is simulated from its measured start speed. Good: the mean over all trips is zero within its "
        "95 % interval, which comes from the scatter between trips. Bad: nearly all windows end too fast (the car "
        "resists more, weighs more or gets less torque than the model says) or too slow.",
    )


def document(found: Ends) -> Mapping[str, object]:
    """For the JSON."""
    return {
        "length_s": found.length,
        "windows": int(found.error.size),
        "trips": found.units,
        "mean_end_error": found.mean,
        "mean_over_windows": float(found.error.mean()),
        "interval95": list(found.interval95),
        "std_by_parameters": found.own,
        "by_trip": {
            found.names[u].rpartition("/")[2]: float(found.error[found.run == u].mean()) for u in np.unique(found.run)
        },
        "unit": "m/s",
    }
