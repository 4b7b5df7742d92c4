"""Order of the logs of a test day, and matching of the logs of several loggers to runs."""

from __future__ import annotations

import re
from collections.abc import Sequence
from itertools import pairwise, takewhile

from vdyn_cli.project.drafting.channel_guess import without_unit
from vdyn_cli.project.drafting.left_out_logs import GuessedLog
from vdyn_cli.project.drafting.run_direction import named_directions

_SAME_DRIVE = 0.9  # share of the total time that all logs of one drive must have in common
_SAME_RUN = 0.2  # of the longer log, least overlap: a logger that starts late records at least a part of the run
_LEAST_SHARE = 0.75  # of the runs that must have a log of a second logger: a few files may be missing

Runs = tuple[tuple[GuessedLog, ...], ...]


def in_driven_order(logs: Sequence[GuessedLog]) -> list[GuessedLog]:
    """The logs by the numbers in their names, which loggers and drivers count up during the day.

    A shell lists ``coast_back_2`` before ``coast_out_1``, and ``coast_10`` before ``coast_2``; without start times, a
    step takes the order of the description as the driven one. Logs of one number: out before back, else as given;
    names without a number keep their places.
    """
    ways = [way.direction for way in named_directions([log.path.name for log in logs])]
    numbers = [[int(n) for n in re.findall(r"\d+", log.path.stem)] for log in logs]
    places = [k for k, own in enumerate(numbers) if own]
    order = iter(sorted(places, key=lambda k: (numbers[k], ways[k] == "back")))
    return [logs[next(order)] if own else log for log, own in zip(logs, numbers, strict=True)]


def logger_runs(logs: Sequence[GuessedLog], needed: Sequence[str]) -> Runs:
    """The logs of each run, in the same order of loggers; empty if every log is a run, or they cannot be matched.

    One run: logs with different columns over about the same time. Several runs: logs of each kind, matched by clocks
    that continue from one log to the next, else by the part in which their file names differ. A run without a log of
    each logger is left out.

    Parameters
    ----------
    needed : channels of which a run needs some; if all logs have the same of these, every log is a run.
    """
    kinds = _kinds(logs)
    if len(kinds) < 2 or any(log.guesses["time"].facts is None for log in logs) or _alike(logs, needed):
        return ()
    first, *others = kinds
    if not _several(kinds):
        return (tuple(logs),) if _one_drive(logs) else ()
    matched = [_partners(first, other) for other in others]
    runs = [(log, *(found.get(id(log)) for found in matched)) for log in first]
    return tuple(tuple(log for log in run if log is not None) for run in runs if None not in run)


def unmatched(logs: Sequence[GuessedLog], needed: Sequence[str]) -> bool:
    """Whether the logs look like those of several loggers but cannot be matched; ``needed`` as in ``logger_runs``."""
    return _several(_kinds(logs)) and not _alike(logs, needed) and not logger_runs(logs, needed)


def _several(kinds: Sequence[Sequence[GuessedLog]]) -> bool:
    """Whether the logs could be those of several loggers in several runs."""
    counts = [len(kind) for kind in kinds]
    return len(kinds) > 1 and min(counts) > 1 and min(counts) >= _LEAST_SHARE * max(counts)


def _kinds(logs: Sequence[GuessedLog]) -> list[list[GuessedLog]]:
    """The logs grouped by equal columns, ignoring units."""
    kinds: dict[tuple[tuple[str, ...], ...], list[GuessedLog]] = {}
    for log in logs:
        names = sorted((*sorted(words), nth) for words, nth in (without_unit(f.column) for f in log.facts))
        kinds.setdefault(tuple(names), []).append(log)
    return list(kinds.values())


def _alike(logs: Sequence[GuessedLog], needed: Sequence[str]) -> bool:
    first = logs[0].decided_columns()
    there = [n for n in needed if n in first]
    return len(there) > 1 and all(log.decided_columns().get(n) == first[n] for log in logs for n in there)


def _one_drive(logs: Sequence[GuessedLog]) -> bool:
    mapped = [tuple(log.columns().items()) for log in logs if len(log.columns()) > 1]
    if len(set(mapped)) < len(mapped):
        return False
    starts, stops = zip(*(_span(log) for log in logs), strict=True)
    together, whole = min(stops) - max(starts), max(stops) - min(starts)
    return bool(together > _SAME_DRIVE * whole)


def _partners(logs: Sequence[GuessedLog], others: Sequence[GuessedLog]) -> dict[int, GuessedLog]:
    """The other logger's log for each log (by its id) that has one; empty if the match is not certain."""
    ways: list[list[list[GuessedLog]]] = []
    if _runs_on(logs) and _runs_on(others):
        ways.append([[other for other in others if _common(log, other) > _SAME_RUN] for log in logs])
    for keys in (_folders, _numbers, _letters):
        named = list(zip(keys(others), others, strict=True))
        ways.append([[other for key, other in named if key == mine] for mine in keys(logs)])
    fewest = min(len(logs), len(others))
    found = next((way for way in ways if _certain(way, fewest)), [])
    return {id(log): each[0] for log, each in zip(logs, found, strict=False) if each}


def _certain(found: Sequence[Sequence[GuessedLog]], pairs: int) -> bool:
    """Whether no log has two partners, none is the partner of two, and the number of pairs is ``pairs``."""
    partners = [id(other) for each in found for other in each]
    return all(len(each) < 2 for each in found) and len(set(partners)) == len(partners) == pairs


def _runs_on(logs: Sequence[GuessedLog]) -> bool:
    """Whether no two logs overlap, so that one clock (of the day or since an epoch) continues from log to log."""
    spans = sorted(_span(log) for log in logs)
    return all(before[1] < after[0] for before, after in pairwise(spans))


def _common(log: GuessedLog, other: GuessedLog) -> float:
    """The overlap in time, as a share of the longer log."""
    (a, b), (c, d) = _span(log), _span(other)
    return (min(b, d) - max(a, c)) / max(b - a, d - c)


def _folders(logs: Sequence[GuessedLog]) -> list[str]:
    """The folder of each file: apps create one for each recording, with a file for each sensor."""
    return [str(log.path.parent) for log in logs]


def _numbers(logs: Sequence[GuessedLog]) -> list[tuple[int, ...]]:
    """The numbers in the name of each file, without those that are the same in all names."""
    found = [[int(n) for n in re.findall(r"\d+", log.path.stem)] for log in logs]
    if len({len(numbers) for numbers in found}) > 1:
        return [tuple(numbers) for numbers in found]
    varying = [k for k, column in enumerate(zip(*found, strict=True)) if len(set(column)) > 1]
    return [tuple(numbers[k] for k in varying) for numbers in found]


def _letters(logs: Sequence[GuessedLog]) -> list[str]:
    """The name of each file without the common beginning and end of all names."""
    names = [log.path.stem.casefold() for log in logs]
    rest = [name[_shared(names) :] for name in names]
    return [name[: len(name) - _shared([other[::-1] for other in rest])] for name in rest]


def _shared(names: Sequence[str]) -> int:
    """The number of characters with which all names begin."""
    return sum(1 for _ in takewhile(lambda letters: len(set(letters)) == 1, zip(*names, strict=False)))


def _span(log: GuessedLog) -> tuple[float, float]:
    clock = log.guesses["time"].facts
    assert clock is not None
    return clock.info.span
