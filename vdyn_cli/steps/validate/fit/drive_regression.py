"""The regression of drives cut into windows: the windows of a drive share its load, its road and its wind.

Each drive has two unknowns with priors: its mean slope i_k, and its load beyond the stated mass. All drives share one
accelerometer with the zero z. With z_k the zero that makes drive k level from end to end, each drive has one more row::

    (z + g i_k - z_k) / drift

The measured slope of a hill is smoothed, while drivers react to a hill at once: torque and speed seem to lag by some
hundredths of a second. These lags are nuisance parameters that all drives share. The start speed of each window is
unknown: its column c is projected out of the window's whitened rows, (1 - c c'/c'c) r, which is equivalent to a fit.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, Rows, Unknown
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.fit.whitening import WhitenedDrives, whiten_drives
from vdyn_cli.steps.validate.road.road_slope import APPARENT_LAGS, DRIVE_SLOPE, drive_slope

LOAD, ZERO = "load", "accelerometer_zero"
LAG_STD = 0.1  # s, prior standard deviation of the apparent lag of torque and speed behind the slope
LARGEST_ZERO = 0.3  # m/s^2: two degrees of tilt


@dataclass(frozen=True)
class BetweenDriveSpread:
    """Standard deviations of mean slope, load and accelerometer zero between drives.

    Parameters
    ----------
    slope : of the mean slope. load : kg. drift : m/s^2, of the accelerometer's zero.
    zeros : (drives of the description,) m/s^2, the zero z_k that makes each of them level from end to end.
    """

    slope: float
    load: float
    drift: float
    zeros: tuple[float, ...]


@dataclass(frozen=True, eq=False)
class _DriveRows:
    whitened: WhitenedDrives
    drives: tuple[tuple[int, ...], ...]
    shared: tuple[str, ...]
    own: tuple[str, ...]
    varies: BetweenDriveSpread

    def __call__(self, run: int, theta: Array) -> Rows:
        setup = self.whitened.setup
        at = dict(zip((*self.shared, *self.own), theta, strict=True))
        base = np.array([at.get(n, 0.0) for n in setup.vector.shared])
        place = {n: i for i, n in enumerate(setup.vector.shared)}
        if LOAD in at:
            base[place["mass"]] += at[LOAD]
        names = (*self.shared, *self.own)
        columns = [place.get("mass" if n == LOAD else n, -1) for n in names]
        parts = [self._zero(self.drives[run], at, names)] if ZERO in at else []
        for k in self.drives[run]:
            local = np.r_[base, setup.vector.start_speed(k)[0], np.zeros(len(setup.vector.own) - 1)]
            parts.append(without_start(self.whitened(k, local), len(setup.vector.shared), columns))
        return joined(parts)

    def _zero(self, windows: tuple[int, ...], at: Mapping[str, float], names: tuple[str, ...]) -> Rows:
        """The row of the accelerometer's zero, (z + g i_k - z_k) / drift."""
        drift, first = self.varies.drift, self.whitened.setup.segments[windows[0]]
        off = at[ZERO] + GRAVITY * at[DRIVE_SLOPE] - self.varies.zeros[first.run]
        slopes = np.array([[{ZERO: 1.0, DRIVE_SLOPE: GRAVITY}.get(n, 0.0) / drift for n in names]])
        return Rows(np.array([off / drift]), slopes, time=first.time[:1])


def drive_regression(setup: SimulationSetup, varies: BetweenDriveSpread) -> Regression:
    """The regression of drives cut into windows; its runs are the drives.

    Parameters
    ----------
    setup : its segments are the windows; its model has the road's slope as an input.
    """
    w = whiten_drives(_sloping(setup, varies), averaged=True)
    whole = w.regression
    names, drives = drives_of(w.setup)
    known: Mapping[str, float] = {
        **({DRIVE_SLOPE: varies.slope} if DRIVE_SLOPE in w.setup.vector.shared and varies.slope > 0 else {}),
        **({LOAD: varies.load} if "mass" in w.setup.vector.shared and varies.load > 0 else {}),
    }
    own = tuple(Unknown(n, 0.0, -50 * s, 50 * s, "", (0.0, s), True, True) for n, s in known.items())
    shared = tuple(u for u in whole.shared if u.name != DRIVE_SLOPE)
    if DRIVE_SLOPE in known and varies.drift > 0:
        zero = Unknown(ZERO, 0.0, -3.0, 3.0, "m/s^2", (0.0, LARGEST_ZERO), nuisance=True)
        base = len(setup.vector.shared) - len(setup.added.unknowns)
        shared = (*shared[:base], zero, *shared[base:])
    rows = _DriveRows(w, drives, tuple(u.name for u in shared), tuple(known), varies)
    return Regression((*shared, *own), names, rows)


def _sloping(setup: SimulationSetup, varies: BetweenDriveSpread) -> SimulationSetup:
    """The setup with an unknown mean slope and unknown lags of torque and speed."""
    lag = Unknown("", 0.0, -1.0, 1.0, "s", (0.0, LAG_STD), nuisance=True, prior_stated=False)
    timings = (replace(lag, name=n) for e in APPARENT_LAGS for n in e.unknowns)
    added = AddedEffects(APPARENT_LAGS, tuple(timings)) + setup.added
    if varies.slope <= 0:
        return replace(setup, added=added)
    slope = Unknown(DRIVE_SLOPE, 0.0, prior=(0.0, varies.slope), nuisance=True, prior_stated=False)
    return replace(setup, added=AddedEffects((drive_slope, *added.effects), (*added.unknowns, slope)))


def drives_of(setup: SimulationSetup) -> tuple[tuple[str, ...], tuple[tuple[int, ...], ...]]:
    """The name of each drive's log, and the indices of its segments."""
    segments, runs = setup.segments, np.array([s.run for s in setup.segments])
    drives = tuple(tuple(np.flatnonzero(runs == u).tolist()) for u in np.unique(runs))
    first = [segments[d[0]].name for d in drives]
    return tuple(name.rpartition(", ")[0] or name for name in first), drives


def joined(parts: Sequence[Rows]) -> Rows:
    """The rows of a drive, from those of its segments."""
    from scipy.linalg import block_diag

    plain = [p.plain for p in parts if p.plain is not None]
    roots = [p.plain_root for p in parts if p.plain_root is not None]
    return Rows(
        np.concatenate([p.residual for p in parts]),
        np.vstack([p.jacobian for p in parts]),
        time=np.concatenate([p.time for p in parts if p.time is not None]),
        plain=(np.concatenate([p for p, _ in plain]), np.vstack([d for _, d in plain])),
        plain_root=np.asarray(block_diag(*roots)) if roots else None,
    )


def without_start(rows: Rows, start: int, columns: list[int]) -> Rows:
    """The rows with the column of the start speed projected out, in the requested columns (-1: zeros).

    Parameters
    ----------
    start : index of the column of the start speed.
    """
    c = rows.jacobian[:, start]
    unit, there = c / np.linalg.norm(c), np.array(columns) >= 0
    matrix = np.column_stack([rows.jacobian[:, columns] * there, rows.residual])
    matrix = matrix - np.outer(unit, unit @ matrix)
    plain = None if rows.plain is None else (rows.plain[0], rows.plain[1][:, columns] * there)
    return Rows(matrix[:, -1], matrix[:, :-1], time=rows.time, plain=plain)
