"""Check whether the logs of several loggers that a description pairs are of the same run.

Two speeds of one car have the same ratio in all runs, as sensors and tires are the same. Logs of two coast-downs of one
car are so similar that a wrong pair can be aligned, but with another ratio.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.quantities.clock_difference import ClockDifference
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log

RATED = ("speed", "vehicle_speed", "wheel_speed", "motor_speed")  # a single wheel's ratio differs from bend to bend
LEAST_RUNS = 3


def with_pair_warnings(clocks: Sequence[ClockDifference], cut: Sequence[CutLog]) -> tuple[CutLog, ...]:
    """The runs ``cut``, with a warning for each doubtful pair of logs."""
    doubts = list(doubtful_pairs(clocks, [one.log for one in cut]))
    own = [tuple(f for f in doubts if f.where == one.log.name) for one in cut]
    return tuple(
        replace(one, log=replace(one.log, findings=(*one.log.findings, *found))) if found else one
        for one, found in zip(cut, own, strict=True)
    )


def doubtful_pairs(clocks: Sequence[ClockDifference], logs: Sequence[Log]) -> Iterator[Finding]:
    """Yield a warning for each run in which the ratio of two loggers' mean speeds differs from the median of all runs.

    By more than ``run_ratio``, relative; with fewer than ``LEAST_RUNS`` runs there is none.

    Parameters
    ----------
    clocks : of all runs. logs : merged, with the first channel of each pair.
    """
    named = {log.name: log for log in logs}
    for pair in dict.fromkeys(c.pair for c in clocks):
        same = [c for c in clocks if c.pair == pair and c.run in named]
        ratios = np.array([_mean_ratio(c, named[c.run]) for c in same])
        if not set(pair) <= set(RATED) or np.isfinite(ratios).sum() < LEAST_RUNS:
            continue
        usual = float(np.nanmedian(ratios))
        for clock, ratio in zip(same, ratios / usual, strict=True):
            if abs(ratio - 1.0) > CHECK.run_ratio:
                speeds = f"'{pair[1]}' over '{pair[0]}'"
                what = f"{speeds} is {ratio:.3f} times its median of all runs: {clock.run} and {clock.logger} "
                remedy = "check which files were recorded together, by their times or by the order of the runs"
                yield Finding(clock.run, f"{what}are probably not from one run", remedy=remedy, doubt=True)


def _mean_ratio(clock: ClockDifference, log: Log) -> float:
    """The logger's mean speed over that of the reference, which a delay hardly affects; NaN without a value."""
    values = log[clock.pair[0]] if clock.pair[0] in log else np.array([])
    mean = float(np.mean(values[np.isfinite(values)])) if np.isfinite(values).any() else 0.0
    return clock.gain + clock.offset / mean if mean > 0.0 else float("nan")
