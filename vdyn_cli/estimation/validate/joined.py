"""Windows of one drive as one run: they share its driver and luggage, its road and its wind.

What a drive has for itself are its mean slope and what its load differs from the stated mass; both are unknowns with
what is known of them. The start speed of each window is taken as unknown beforehand: its column c is projected out of
the window's whitened rows, (1 - c c'/c'c) r, which is the same as fitting it.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.estimation.validate.felt import DRIVE_SLOPE, MEAN_SLOPE
from vdyn_cli.estimation.validate.regression import Weighed, weigh
from vdyn_cli.estimation.validate.trial import Trial
from vdyn_cli.fit import Regression, Rows, Unknown

Array = NDArray[np.float64]
LOAD = "load"


@dataclass(frozen=True)
class Varies:
    """Standard deviations of what differs from drive to drive: mean slope, and load in kg."""

    slope: float
    load: float


@dataclass(frozen=True, eq=False)
class _Joined:
    weighed: Weighed
    drives: tuple[tuple[int, ...], ...]
    shared: tuple[str, ...]
    own: tuple[str, ...]

    def __call__(self, run: int, theta: Array) -> Rows:
        trial = self.weighed.trial
        at = dict(zip((*self.shared, *self.own), theta, strict=True))
        base = np.array([at.get(n, 0.0) for n in trial.shared])
        place = {n: i for i, n in enumerate(trial.shared)}
        if LOAD in at:
            base[place["mass"]] += at[LOAD]
        columns = [place["mass" if n == LOAD else n] for n in (*self.shared, *self.own)]
        parts = []
        for k in self.drives[run]:
            local = np.r_[base, trial.begun(k)[0], np.zeros(len(trial.own) - 1)]
            parts.append(_without_start(self.weighed(k, local), len(trial.shared), columns))
        return Rows(
            np.concatenate([p.residual for p in parts]),
            np.vstack([p.jacobian for p in parts]),
            time=np.concatenate([p.time for p in parts if p.time is not None]),
            plain=(
                np.concatenate([p.plain[0] for p in parts if p.plain]),
                np.vstack([p.plain[1] for p in parts if p.plain]),
            ),
        )


def joined(trial: Trial, varies: Varies) -> Regression:
    """The regression of whole drives that were cut into windows."""
    w = weigh(_sloping(trial, varies), calm=True)
    whole = w.regression
    runs = np.array([s.run for s in w.trial.stretches])
    drives = tuple(tuple(np.flatnonzero(runs == u).tolist()) for u in np.unique(runs))
    names = tuple(w.trial.stretches[d[0]].name.rpartition(", ")[0] for d in drives)
    known: Mapping[str, float] = {
        **({DRIVE_SLOPE: varies.slope} if DRIVE_SLOPE in w.trial.shared and varies.slope > 0 else {}),
        **({LOAD: varies.load} if "mass" in w.trial.shared and varies.load > 0 else {}),
    }
    own = tuple(Unknown(n, 0.0, -50 * s, 50 * s, "", (0.0, s), True, True) for n, s in known.items())
    shared = tuple(u for u in whole.shared if u.name != DRIVE_SLOPE)
    rows = _Joined(w, drives, tuple(u.name for u in shared), tuple(known))
    return Regression((*shared, *own), names, rows)


def _sloping(trial: Trial, varies: Varies) -> Trial:
    """The trial with a mean slope that is not known."""
    if varies.slope <= 0:
        return trial
    slope = Unknown(DRIVE_SLOPE, 0.0, prior=(0.0, varies.slope), nuisance=True)
    return replace(trial, effects=(MEAN_SLOPE, *trial.effects), extra=(*trial.extra, slope))


def _without_start(rows: Rows, start: int, columns: list[int]) -> Rows:
    """The rows with the start's column projected out, over the columns that are asked for."""
    c = rows.jacobian[:, start]
    unit = c / np.linalg.norm(c)
    matrix = np.column_stack([rows.jacobian[:, columns], rows.residual])
    matrix = matrix - np.outer(unit, unit @ matrix)
    plain = None if rows.plain is None else (rows.plain[0], rows.plain[1][:, columns])
    return Rows(matrix[:, -1], matrix[:, :-1], time=rows.time, plain=plain)
