"""Runs split at long cuts: the parts of a run whose channels a step integrates or simulates with are complete."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from vdyn_cli.description.test_description import TestSpec
from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.io.quality.quality_policy import QUALITY, QualityPolicy
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps import Step

S = TypeVar("S", bound=TestSpec)


def split_runs(step: Step, spec: S, cut: Sequence[CutLog], ready: Callable[[Log], Log]) -> tuple[S, tuple[CutLog, ...]]:
    """The description and logs with a run of its own for each part between long cuts, and short cuts filled.

    Runs are split at cuts longer than ``longest_bridge`` of the step's complete and unbroken channels; parts shorter
    than ``shortest_part`` are left out. Shorter cuts of complete channels are filled by straight lines. All other cuts
    stay missing samples.

    Parameters
    ----------
    spec, cut : one log for each run. ready : adds the channels that are made from others to a log before its cuts.
    """
    runs, logs = [], []
    for run, one in zip(spec.runs, cut, strict=True):
        parts = _parts(one, (*step.complete, *step.unbroken), QUALITY)
        for start, stop in parts:
            part = one.between(start, stop)
            findings = one.log.findings if (start, stop) == parts[0] else ()
            log = replace(part.log, name=f"{one.log.name}, {start:.1f} to {stop:.1f} s", findings=findings)
            logs.append(replace(part, log=bridged(log, ready(part.whole), step.complete), ledger=one.ledger))
            window = {"from_time": Given(start, 0.0), "to_time": Given(stop, 0.0)}
            runs.append(run.model_copy(update=window))
        if not parts:
            logs.append(replace(one, log=bridged(one.log, ready(one.whole), step.complete)) if one.ledger else one)
            runs.append(run)
    return spec.model_copy(update={"runs": runs}), tuple(logs)


def bridged(log: Log, whole: Log, names: Sequence[str]) -> Log:
    """The log with straight lines over the cuts of some channels, where they last up to ``longest_bridge``.

    Parameters
    ----------
    whole : the log before the cuts, on the same clock.
    """
    filled = {}
    for name in names:
        if name not in log or name not in whole:
            continue
        known = np.flatnonzero(np.isfinite(log[name]))
        cut = np.flatnonzero(np.isnan(log[name]) & np.isfinite(whole[name]))
        after = np.searchsorted(known, cut)
        inside = (after > 0) & (after < known.size)
        cut, after = cut[inside], after[inside]
        short = log.time[known[after]] - log.time[known[after - 1]] <= QUALITY.longest_bridge
        if short.any():
            values = log[name].copy()
            values[cut[short]] = np.interp(log.time[cut[short]], log.time[known], values[known])
            filled[name] = values
    return log.with_channels(**filled) if filled else log


def _parts(one: CutLog, unbroken: Sequence[str], policy: QualityPolicy) -> list[tuple[float, float]]:
    """First and last time of each part of a run; none where nothing splits it."""
    time = one.log.time
    holes = sorted((r.start, r.stop) for r in one.ledger if _breaks(r, one, unbroken, policy))
    if not holes:
        return []
    parts, begin = [], 0
    for start, stop in [*holes, (np.inf, np.inf)]:
        end = int(np.searchsorted(time, start, "left"))
        if end - begin >= 2 and time[end - 1] - time[begin] >= policy.shortest_part:
            parts.append((float(time[begin]), float(time[end - 1])))
        begin = max(begin, int(np.searchsorted(time, stop, "right")))
    return parts


def _breaks(row: LedgerRow, one: CutLog, unbroken: Sequence[str], policy: QualityPolicy) -> bool:
    """Whether a cut leaves a gap in an unbroken channel, or in one that it is made from, too long to be bridged."""
    if row.decision == "kept" or row.stop - row.start <= policy.longest_bridge:
        return False
    inside = slice(*np.searchsorted(one.log.time, [row.start, np.nextafter(row.stop, np.inf)]))
    return any(np.isnan(one.log[n][inside]).any() for n in unbroken if n in one.log)
