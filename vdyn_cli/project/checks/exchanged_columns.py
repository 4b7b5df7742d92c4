"""Detection of runs in which two columns are exchanged: each looks like the other column in all other runs."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from itertools import combinations

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import to_si

FEWEST_OTHERS = 3  # other runs, least number that shows what is usual
_ROUND = 1e-6  # of a channel's size, least roughness


def exchanged_columns(
    logs: Sequence[Log], columns: Mapping[str, tuple[str, str, str]], own: Sequence[Mapping[str, str]]
) -> Iterator[Finding]:
    """A problem for each run that has two columns exchanged.

    Size, sign and roughness of a channel, in the unit of its column, are compared with the medians of the other runs,
    of which at least three must exist. Exchanged: the distance from these exceeds ``exchanged_distance``, and
    ``exchanged_outlying`` times that of any other run, and ``exchanged_ratio`` times that with both columns exchanged.

    Parameters
    ----------
    logs : of the runs. columns : for each channel its column, unit and SI unit in the description.
    own : for each run, the columns that the description states for it alone.
    """
    names = [n for n in columns if n != "time" and all(n in log for log in logs)]
    if len(logs) <= FEWEST_OTHERS:
        return
    looks = {n: np.array([_features(log, n, columns[n][1:]) for log in logs]) for n in names}
    for a, b in combinations(names, 2):
        for k, log in enumerate(logs):
            if not {a, b} & own[k].keys() and _exchanged(looks[a], looks[b], k):
                (column, unit, _), (other, other_unit, _) = columns[a], columns[b]
                what = (
                    f"'{a}' looks like '{b}' of the other runs, and '{b}' like their '{a}': two columns are exchanged"
                )
                keys = f'columns: {{{a}: "{other}", {b}: "{column}"}}, units: {{{a}: {unit}, {b}: {other_unit}}}'
                yield Finding(log.name, what, "", f"correct the header of the file, or write '{keys}' at this run")


def _features(log: Log, channel: str, units: tuple[str, str]) -> Array:
    """Logarithm of the size, whether it has negative values (0, 1), and logarithm of the roughness of a channel."""
    values = log[channel][np.isfinite(log[channel])] / (to_si(1.0, *units) - to_si(0.0, *units))
    if values.size < FEWEST_OTHERS:
        return np.full(3, np.nan)
    size = max(float(np.quantile(np.abs(values), 0.98)), _ROUND)
    rough = float(np.median(np.abs(np.diff(values, 2)))) / size
    below = float(np.mean(values < -_ROUND * size) > 0.01)
    return np.array([np.log(size), below, np.log(max(rough, _ROUND))])


def _exchanged(first: Array, second: Array, k: int) -> bool:
    """Whether the two channels, (runs, 3) each, are exchanged in run ``k``."""
    others = np.arange(len(first)) != k
    usual, usual_second = (np.median(look[others], axis=0) for look in (first, second))

    def apart(i: int, one: Array, two: Array) -> float:
        return float(np.abs(first[i] - one).sum() + np.abs(second[i] - two).sum())

    own, crossed = apart(k, usual, usual_second), apart(k, usual_second, usual)
    spread = max(apart(int(i), usual, usual_second) for i in np.flatnonzero(others))
    return (
        own > max(QUALITY.exchanged_outlying * spread, QUALITY.exchanged_distance)
        and own > QUALITY.exchanged_ratio * crossed
    )
