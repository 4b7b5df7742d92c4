"""A bump's measured profile, read from its file and reduced to the points that its shape needs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.physics.models.half_car import Points
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.bump.spec import BumpSpec

TOLERANCE = 1e-5  # m, resolution of a good profilometer: smaller steps of height are noise
WORTH_REPORTING = 2e-5  # m, twice the first tolerance: above it the limit on the number of points costs accuracy
MOST_POINTS = 150  # each is a branch of the simulated road in every integration step
FEWEST_POINTS, LOWEST = 3, 1e-3  # points, and m of height: fewer or less is not a bump


@dataclass(frozen=True)
class BumpData:
    """The crossings' logs, and the bump's measured profile if there is one.

    Parameters
    ----------
    runs : one log for each crossing, SI units.
    profile : points (position, height) in m, the first at height 0. findings : about the profile.
    """

    runs: tuple[Log, ...]
    profile: Points | None = None
    findings: tuple[Finding, ...] = ()


def load(spec: BumpSpec, folder: Path, logs: tuple[Log, ...]) -> tuple[BumpData, tuple[Path, ...]]:
    """Read the bump's profile, if the description names one, and combine it with the runs.

    Parameters
    ----------
    folder : of the description. logs : of the runs.

    Returns
    -------
    The data, and the paths that were read.

    Raises
    ------
    InputError : the file cannot be read, or does not contain a bump.
    """
    bump = spec.obstacle
    if bump.profile is None:
        return BumpData(logs), ()
    path = folder / bump.profile
    # The distance serves as the log's time, because it increases.
    places = {"time": bump.columns.distance, "height": bump.columns.height}
    columns = {
        n: Column(c.column, c.unit, "m", c.sign, scale=c.scale, where=f"bump.columns, {c.column}")
        for n, c in places.items()
    }
    table = read_log(path, columns, ReadOptions(**bump.reading.model_dump()))
    good = np.isfinite(table["height"])
    position, height = table.time[good], table["height"][good]
    if position.size < FEWEST_POINTS or not np.ptp(height) > LOWEST:
        got = f"{position.size} points, {1e3 * float(np.ptp(height)):.2f} mm from lowest to highest"
        raise InputError(Finding(bump.profile, "is not the profile of a bump", got, "check columns and units"))
    points, error = simplified(position, height)
    findings = []
    if error > WORTH_REPORTING:
        what = f"{len(points)} of {position.size} points are used; the others lie within {1e3 * error:.2f} mm of them"
        findings.append(Finding(bump.profile, what))
    return BumpData(logs, points, tuple(findings)), (path,)


def simplified(position: Array, height: Array, tolerance: float = TOLERANCE) -> tuple[Points, float]:
    """The fewest measured points whose polyline approximates the others, and its largest error, m.

    Ramer-Douglas-Peucker: a segment whose points all lie within the tolerance becomes one line. The tolerance begins
    at ``tolerance``, m, and is doubled until at most 150 points are left.

    Parameters
    ----------
    position, height : (n,) m, position increasing.
    """
    while (kept := _corners(position, height, tolerance)).size > MOST_POINTS:
        tolerance *= 2
    error = float(np.max(np.abs(height - np.interp(position, position[kept], height[kept]))))
    points = tuple((float(x), float(h - height[0])) for x, h in zip(position[kept], height[kept], strict=True))
    return points, error


def _corners(position: Array, height: Array, tolerance: float) -> NDArray[np.intp]:
    """Indices of the points of the polyline."""
    kept = {0, position.size - 1}
    open_segments = [(0, position.size - 1)]
    while open_segments:
        first, last = open_segments.pop()
        if last - first < 2:
            continue
        inner = slice(first + 1, last)
        line = np.interp(position[inner], position[[first, last]], height[[first, last]])
        away = np.abs(height[inner] - line)
        worst = first + 1 + int(np.argmax(away))
        if away.max() > tolerance:
            kept.add(worst)
            open_segments += [(first, worst), (worst, last)]
    return np.array(sorted(kept), dtype=np.intp)
