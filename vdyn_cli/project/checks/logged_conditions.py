"""Directions and start times of runs that the logs contradict by a heading, a place, a clock, or by their names."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import pairwise
from typing import Any

import numpy as np

from vdyn_cli.description.description_model import Run
from vdyn_cli.description.yaml_source import YamlSource
from vdyn_cli.io.channel_survey import ChannelFacts, survey
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.project.drafting.run_conditions import logged_starts
from vdyn_cli.project.drafting.run_direction import (
    LoggedDirection,
    logged_directions,
    named_directions,
    shows_direction,
)
from vdyn_cli.project.reading.logger_columns import log_names
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

_MINUTE = 60.0  # s
_OTHER = {"out": "back", "back": "out"}


def contradicted_conditions(spec: Any, source: YamlSource) -> Iterator[Finding]:
    """A problem for each run whose stated direction or start the log itself contradicts, mapped or not.

    Parameters
    ----------
    spec, source : the description, whose runs have been read, and its lines.
    """
    runs: Sequence[Run] = spec.runs
    if not any(run.direction or run.start for run in runs):
        return
    named = list(wrong_directions(runs, named_directions([log_names(run)[0] for run in runs]), source))
    logged = list(_contradicted_by_values(runs, source))
    places = {finding.where for finding in logged}
    yield from (finding for finding in named if finding.where not in places)
    yield from logged


def _contradicted_by_values(runs: Sequence[Run], source: YamlSource) -> Iterator[Finding]:
    """Runs whose direction or start a heading, a place or a clock in the log contradicts."""
    try:
        facts = []
        for run in runs:
            file = source.path.parent / log_names(run)[0]
            facts.append(survey(file, _span(run), run.recordings[0] or 1, shows_direction))
            if not (any(shows_direction(f.column) for f in facts[0]) or any(run.start for run in runs)):
                return  # logs of one day have the same columns
    except InputError:  # a table of several runs, which its own reader has read
        return
    yield from wrong_directions(runs, logged_directions(facts), source)
    yield from wrong_starts(runs, facts, source)


def _span(run: Run) -> tuple[float, float] | None:
    if run.from_time is None and run.to_time is None:
        return None
    return (run.from_time.value if run.from_time else -np.inf), (run.to_time.value if run.to_time else np.inf)


def wrong_directions(runs: Sequence[Run], logged: Sequence[LoggedDirection], source: YamlSource) -> Iterator[Finding]:
    """Runs that were driven against the other runs of their stated direction.

    Which bearing is ``out`` follows from the majority of the runs; in a tie nothing is known.
    """
    both = [(k, run.direction, way) for k, (run, way) in enumerate(zip(runs, logged, strict=True)) if way.direction]
    agree = [(k, stated == way.direction) for k, stated, way in both if stated is not None]
    right = sum(same for _, same in agree)
    if 2 * right == len(agree) or right in (0, len(agree)):
        return
    for k, same in agree:
        if same != (2 * right > len(agree)):
            stated = str(runs[k].direction)
            what = (
                f"the log {log_names(runs[k])[0]} shows the opposite direction ({logged[k].why}) "
                f"to most runs with '{stated}'"
            )
            yield Finding(source.where(("runs", k, "direction")), what, "", f"write 'direction: {_OTHER[stated]}'")


def wrong_starts(runs: Sequence[Run], facts: Sequence[Sequence[ChannelFacts]], source: YamlSource) -> Iterator[Finding]:
    """Runs whose stated start differs from that of the log's clock by more than ``start_error``, or by their order.

    Parameters
    ----------
    runs : of the description. facts : of every channel of each run's logs. source : of the description, for messages.
    """
    stated = [run.start.value for run in runs if run.start is not None]
    for k, start in enumerate(stated if len(stated) == len(runs) else ()):
        if start in stated[:k] and runs[k].from_time is None:
            what = f"'start' is that of {log_names(runs[stated.index(start)])[0]}, too: two runs cannot start together"
            remedy = "write the start of each run, or remove 'start' from all runs"
            yield Finding(source.where(("runs", k, "start")), what, f"{start:.0f} s", remedy)
    logged = logged_starts(facts)
    if len(stated) == len(runs) and not logged:
        yield from _overlapping_starts(runs, np.array(stated), facts, source)
    if len(stated) < len(runs) or not logged or any(run.from_time is not None for run in runs):
        return
    off = np.array(stated) - np.array(logged)
    off -= np.median(off)
    exchanged = (np.argsort(stated, kind="stable") != np.argsort(logged, kind="stable")).any()
    limit = 1.0 if exchanged else CHECK.start_error
    for k in (k for k in range(len(off)) if abs(off[k]) > limit):
        what = f"'start' differs by {off[k]:+.0f} s from the clock of {log_names(runs[k])[0]}"
        remedy = f"write 'start: {logged[k] - logged[0]:.0f} s', or remove 'start' from all runs"
        yield Finding(source.where(("runs", k, "start")), what, f"{stated[k]:.0f} s", remedy)


def _overlapping_starts(
    runs: Sequence[Run], stated: Array, facts: Sequence[Sequence[ChannelFacts]], source: YamlSource
) -> Iterator[Finding]:
    """Runs of whole logs whose stated start (runs,), s, is well before the end of the run that starts before them."""
    last = [next((np.ptp(f.info.span) for f in one if f.state == "clock"), np.nan) for one in facts]
    limit = CHECK.start_overlap + (_MINUTE if not (stated % _MINUTE).any() else 0.0)
    order = [int(k) for k in np.argsort(stated, kind="stable") if runs[k].from_time is None and runs[k].to_time is None]
    for before, k in pairwise(order):
        together = stated[before] + last[before] - stated[k]
        if together > limit and stated[before] < stated[k]:
            other = f"{log_names(runs[before])[0]}, which lasts {last[before]:.0f} s"
            what = f"'start' is {together:.0f} s before the end of {other}"
            remedy = "write the start of each run, or remove 'start' from all runs"
            yield Finding(source.where(("runs", k, "start")), what, f"{stated[k]:.0f} s", remedy)
