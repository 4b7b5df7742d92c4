"""Split of runs at long cuts, so that the channels that a step integrates or simulates with are complete."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TypeVar

import numpy as np

from vdyn_cli.description.description_model import Description
from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps import Step

S = TypeVar("S", bound=Description)


def split_runs(step: Step, spec: S, cut: Sequence[CutLog], ready: Callable[[Log], Log]) -> tuple[S, tuple[CutLog, ...]]:
    """The description and logs with a separate run for each part between long cuts, and short cuts interpolated.

    Runs are split at cuts longer than ``longest_bridge`` of the step's complete and unbroken channels; parts shorter
    than ``shortest_part``, or with fewer rows than the step needs, are left out. Shorter cuts of complete channels are
    interpolated linearly. All other cuts remain missing samples.

    Parameters
    ----------
    spec, cut : description and its logs, one for each run. ready : adds the computed channels to a log before its cuts.
    """
    runs, logs = [], []
    for run, one in zip(spec.runs, cut, strict=True):
        parts = _parts(one, (*step.complete, *step.unbroken), step.fewest_rows)
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
    """The log with linear interpolation over cuts of up to ``longest_bridge``, and a note on each channel.

    Adjacent cuts of single samples count as one cut.

    Parameters
    ----------
    whole : the log before the cuts, on the same clock. names : channels to interpolate.
    """
    filled, notes = {}, list[Finding]()
    for name in names:
        if name not in log or name not in whole:
            continue
        known = np.flatnonzero(np.isfinite(log[name]))
        cut = np.flatnonzero(np.isnan(log[name]) & np.isfinite(whole[name]))
        after = np.searchsorted(known, cut)
        inside = (after > 0) & (after < known.size)
        cut, after = cut[inside], after[inside]
        _, gap = np.unique(after, return_inverse=True)
        first, last = np.flatnonzero(np.diff(gap, prepend=-1)), np.flatnonzero(np.diff(gap, append=-1))
        short = (log.time[cut[last]] - log.time[cut[first]] <= QUALITY.longest_bridge)[gap]
        if short.any():
            values = log[name].copy()
            values[cut[short]] = np.interp(log.time[cut[short]], log.time[known], values[known])
            filled[name] = values
            where, what = f"{log.name}, channel '{name}'", f"{_counted(int(short.sum()))} interpolated linearly"
            notes.append(Finding(where, what, minor=True))
    if not filled:
        return log
    return replace(log.with_channels(**filled), findings=(*log.findings, *notes), samples=log.samples)


def _counted(samples: int) -> str:
    return f"{samples} cut samples are" if samples > 1 else "1 cut sample is"


def _parts(one: CutLog, unbroken: Sequence[str], fewest: int) -> list[tuple[float, float]]:
    """First and last time of each part of a run; empty if it is not split."""
    time = one.log.time
    holes = [hole for hole in _joined(one) if _breaks(hole, one, unbroken)]
    if not holes:
        return []
    parts, begin = [], 0
    for start, stop in [*holes, (np.inf, np.inf)]:
        end = int(np.searchsorted(time, start, "left"))
        if end - begin >= fewest and time[end - 1] - time[begin] >= QUALITY.shortest_part:
            parts.append((float(time[begin]), float(time[end - 1])))
        begin = max(begin, int(np.searchsorted(time, stop, "right")))
    return parts


def _joined(one: CutLog) -> list[tuple[float, float]]:
    """First and last time of each cut; cuts of one channel without a sample between them are one cut."""
    found = list[tuple[float, float]]()
    for channel in dict.fromkeys(r.channel for r in one.ledger):
        joined = list[tuple[float, float]]()
        rows = (r for r in one.ledger if r.channel == channel and r.decision != "kept")
        for start, stop in sorted((r.start, r.stop) for r in rows):
            last = joined[-1] if joined else (np.inf, -np.inf)
            if np.searchsorted(one.log.time, start) <= np.searchsorted(one.log.time, last[1], "right") and joined:
                joined[-1] = last[0], max(stop, last[1])
            else:
                joined.append((start, stop))
        found += joined
    return sorted(found)


def _breaks(hole: tuple[float, float], one: CutLog, unbroken: Sequence[str]) -> bool:
    """Whether a cut leaves a gap in an unbroken channel that is too long to be interpolated."""
    start, stop = hole
    if stop - start <= QUALITY.longest_bridge:
        return False
    inside = slice(*np.searchsorted(one.log.time, [start, np.nextafter(stop, np.inf)]))
    return any(np.isnan(one.log[n][inside]).any() for n in unbroken if n in one.log)
