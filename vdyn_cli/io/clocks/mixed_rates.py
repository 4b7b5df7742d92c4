"""Channels of different rates in one table, with blanks between the values of the slower ones: one log per rate."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import partial

import numpy as np

from vdyn_cli.io.clocks.changed_values import held, rows_until_change
from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log, LogSource

_FEWEST_VALUES = 4  # values, least number that shows a rate
_REGULAR = 0.9  # share of the steps that must equal the median step: random blanks leave steps of all lengths
_NEAR = 0.25  # of the median step, tolerance: bus messages are this regular
_BETWEEN = 0.25  # runs of blanks per value: fewer are dropouts, and one is a gap


def slower_rows(time: Array, values: Array) -> Rows | None:
    """The rows (m,) of a table at which a slower channel (n,) has values; None if it has the table's clock.

    These are every k-th row, k > 1, or rows between those of other channels. Gaps and randomly missing values are not
    a slower rate.
    """
    written = np.isfinite(values)
    if written.all() or np.count_nonzero(written) < _FEWEST_VALUES:
        return None
    rows = np.flatnonzero(written)
    steps = np.diff(rows)
    usual = float(np.median(steps))
    if usual >= 2.0:
        near = np.abs(steps - usual) <= max(1.0, _NEAR * usual)
    else:
        apart = np.diff(time[rows])
        near = np.abs(apart - np.median(apart)) <= _NEAR * np.median(apart)
        near &= bool(np.count_nonzero(steps > 1) >= _BETWEEN * rows.size)
    return rows if near.mean() > _REGULAR else None


def split_by_rate(log: Log) -> Log:
    """The log of a table, as read, with the channels of other rates moved to ``source.others``.

    The log has the rows of its first channel; blanks that do not show a slower rate stay NaN. Where the logger wrote
    channels only at changes (``rows_until_change``), blanks hold the last value.
    """
    if log.source is None or not log.channels:
        return log
    changed = rows_until_change(log)
    found = {name: changed.get(name, slower_rows(log.time, values)) for name, values in log.channels.items()}
    if all(rows is None for rows in found.values()):
        return log
    groups: dict[bytes, list[str]] = {}
    for name, rows in found.items():
        groups.setdefault(b"" if rows is None else rows.tobytes(), []).append(name)
    first, *others = (_part(log, log.source, names, found[names[0]]) for names in groups.values())
    source = replace(first.source or log.source, others=(*log.source.others, *others), problems=log.source.problems)
    return replace(first, source=source, findings=(*log.findings, *_at_changes(log, changed)))


def _at_changes(log: Log, changed: Mapping[str, Rows]) -> Iterator[Finding]:
    if changed:
        names = ", ".join(f"'{name}'" for name in changed)
        what = f"written only where the value changes: {names}"
        yield Finding(log.name, what, remedy="no action needed: each value holds until the next one", minor=True)


def _part(log: Log, source: LogSource, names: list[str], rows: Rows | None) -> Log:
    """Some channels at ``rows``; None: at all rows."""
    columns = {name: source.columns[name] for name in ("time", *names)}
    channels = {name: log[name] for name in names}
    if rows is None:
        return Log(log.name, log.time, channels, (), replace(source, columns=columns, problems=(), others=()))
    line_of = partial(_line, source, rows)
    own = {name: held(values, rows) for name, values in channels.items()}
    return Log(log.name, log.time[rows], own, (), LogSource(columns, line_of, row=source.row))


def _line(source: LogSource, rows: Rows, sample: int) -> int:
    return source.line_of(int(rows[sample]))
