"""The deceleration by hills, where the position is logged: what runs of both directions repeat at a place.

A slope decelerates the runs of one direction and accelerates those of the other by as much at the same place. A brake
decelerates only the runs that it stops, even if every run of a direction is braked at the same place. So of the
excess decelerations, only the part that other runs of both directions show with opposite signs is a hill::

    i(x) = sign(o) min(|o|, |b|)  if o b < 0, else 0

with o and b the medians over the other runs out and back.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array


@dataclass(frozen=True)
class PlacedExcess:
    """Excess deceleration of one run, (b,) m/s^2, at the road coordinates ``place`` (b,) m, driven out (+1) or back."""

    heading: float
    place: Array
    excess: Array

    def at(self, place: Array) -> Array:
        """The excess at other coordinates (n,) m, NaN where the run did not pass."""
        order = np.argsort(self.place)
        return np.interp(place, self.place[order], self.excess[order], left=np.nan, right=np.nan)


def repeated_slope(runs: Sequence[PlacedExcess]) -> list[Array]:
    """For each run, the deceleration by hills that the other runs of both directions show where it passed, (b,) m/s^2.

    The smaller of the medians out and back where these have opposite signs, else zero; zero also where no other run of
    a direction passed.
    """
    found = []
    for one in runs:
        others = [r for r in runs if r is not one]
        out, back = (_median([r.at(one.place) for r in others if r.heading == h], one.place) for h in (1.0, -1.0))
        hill = np.where(out * back < 0.0, np.sign(out) * np.minimum(np.abs(out), np.abs(back)), 0.0)
        found.append(one.heading * hill)
    return found


def _median(values: Sequence[Array], place: Array) -> Array:
    """Median over the runs at each place, zero where none passed."""
    table = np.array([np.full(place.size, np.nan), *values])
    passed = np.isfinite(table).any(axis=0)
    result = np.zeros(place.size)
    result[passed] = np.nanmedian(table[:, passed], axis=0)
    return result
