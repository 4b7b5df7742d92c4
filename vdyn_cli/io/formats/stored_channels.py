"""Reading of formats that store channels separately, possibly on several clocks: selection of channels, and the log."""

from __future__ import annotations

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import NoReturn, Protocol

import numpy as np

from vdyn_cli.io.clocks.appended_recordings import recording_rows, restarts
from vdyn_cli.io.clocks.clock_unit import clock_unit
from vdyn_cli.io.clocks.sample_times import check_rising
from vdyn_cli.io.column_names import MissingColumn, closest_names, positions
from vdyn_cli.io.file_units import contradicted_name_end, contradiction, contradicts, stated_unit, unit_problem
from vdyn_cli.io.files import folder_error
from vdyn_cli.io.formats.split_times import split_instants
from vdyn_cli.io.reader import Column, ReadOptions, Recorded, UnitFrom, channel_info, clock_seconds, is_clock, rises
from vdyn_cli.quantities.arrays import Array, Rows
from vdyn_cli.quantities.errors import Finding, InputError, raise_all
from vdyn_cli.quantities.log import Log, LogSource

_TOGETHER = 16  # channels read in one pass over their table: fewer take more time, more take more memory


@dataclass(frozen=True)
class StoredChannel:
    """One channel of a file.

    Parameters
    ----------
    name, unit, group, source : as the file writes them; empty if it writes none.
    table : key of its table; channels of one table share their rows and so their clock.
    at : key by which the format locates it.
    master : whether the format defines it as the clock of its table, in the unit ``unit``.
    begin : zero of a clock that was recorded as times of day, s since midnight; NaN for other channels.
    """

    name: str
    unit: str
    table: Hashable
    at: Hashable
    group: str = ""
    source: str = ""
    master: bool = False
    begin: float = math.nan

    @property
    def path(self) -> str:
        """Group and name, unique where the name alone is not."""
        return f"{self.group}.{self.name}" if self.group else self.name


class StoredFile(Protocol):
    """An open file of a format that stores channels separately."""

    @property
    def row(self) -> str:
        """The word for a sample's place in messages: line, row, sample."""

    @property
    def listed(self) -> Sequence[StoredChannel]:
        """All channels, in the file's order."""

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number in the file of a row of a channel's table."""

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples (n,) of channels of one table, NaN where no value is recorded; None for one without numbers."""


def missing_library(path: Path, library: str, extra: str, kind: str) -> NoReturn:
    """Refuse a file whose library is not installed.

    Parameters
    ----------
    extra : optional dependency of vdyn_cli that installs the library. kind : the file's type, with its article.

    Raises
    ------
    InputError : always; the remedy is the command that installs the library.
    """
    what = f"is {kind}; the library that reads it, {library}, is not installed"
    raise InputError(Finding(str(path), what, remedy=f"pip install 'vdyn_cli[{extra}]'"))


def damaged_file(path: Path, library: str, error: Exception) -> InputError:
    """The error for a file that a library cannot read, with the library's error."""
    what = f"is damaged or incomplete: {library} cannot read it ({type(error).__name__}: {error})"
    return InputError(Finding(str(path), what[:200], remedy="copy, export or record the file again"))


@contextmanager
def damage_reported(path: Path, library: str, *errors: type[Exception]) -> Iterator[None]:
    """Context that converts a library's errors on a damaged file to an InputError.

    Parameters
    ----------
    errors : types of exceptions that the library raises for damaged files.
    """
    try:
        yield
    except (InputError, MemoryError):
        raise
    except errors as error:
        raise damaged_file(path, library, error) from None


def refuse_missing(path: Path) -> None:
    """Refuse a path that does not exist or is a folder.

    Raises
    ------
    InputError : it does not exist or is a folder.
    """
    if not path.exists():
        remedy = "check the path; it is relative to the folder of the description"
        raise InputError(Finding(str(path), "no such file", remedy=remedy))
    if path.is_dir():
        raise folder_error(path)


def read_stored(file: StoredFile, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
    """The mapped channels of a file, each on its own clock; see ``vdyn_cli.io.reader.Reader.read``.

    The log has the clock of the group stated for the channel ``time``, or else that of the first mapped channel;
    ``source.others`` contains the channels on other clocks.

    Raises
    ------
    InputError : with all problems of the file.
    """
    chosen, findings, problems = _chosen(file.listed, mapping, name)
    raise_all([*_text_options(options, name), *problems])
    groups: dict[Hashable, list[str]] = {}
    clocks: dict[Hashable, StoredChannel] = {}
    for channel, stored in chosen.items():
        if channel != "time":
            try:
                clock = _clock(file.listed, stored, mapping["time"], name)
            except InputError as error:
                problems += [f for f in error.findings if f not in problems]
                continue
            clocks[clock.at] = clock
            groups.setdefault(clock.at, []).append(channel)
    raise_all(problems)
    if not groups:
        clocks[chosen["time"].at], groups[chosen["time"].at] = chosen["time"], []
    first = chosen["time"].at if mapping["time"].group and chosen["time"].at in groups else next(iter(groups))
    order = [first, *(at for at in groups if at != first)]
    logs = [_on_its_clock(file, clocks[at], {c: chosen[c] for c in groups[at]}, mapping, options, name) for at in order]
    raise_all(f for log in logs if isinstance(log, tuple) for f in log)
    reference, *others = (log for log in logs if isinstance(log, Log))
    source = replace(reference.source or LogSource({}, int), others=tuple(others))
    return replace(reference, findings=(*findings, *reference.findings), source=source)


def recorded(file: StoredFile) -> Iterator[Recorded]:
    """Every channel of a file with its samples and times, table by table, in the file's order within each."""
    tables: dict[Hashable, list[StoredChannel]] = {}
    for channel in file.listed:
        tables.setdefault(channel.table, []).append(channel)
    for members in tables.values():
        clock, time, unit, source = _rising_clock(file, members)
        for first in range(0, len(members), _TOGETHER):
            some = members[first : first + _TOGETHER]
            for channel, values in zip(some, file.columns(some), strict=True):
                if channel == clock:
                    yield _recorded(replace(channel, unit=unit), time, time, source)
                else:
                    yield _recorded(channel, values, time)


def _rising_clock(
    file: StoredFile, members: Sequence[StoredChannel]
) -> tuple[StoredChannel | None, Array | None, str, UnitFrom]:
    """The clock of a table, its times in s, its unit and the source of it.

    The clock is the table's master, or else the first increasing column named like a clock; none if it restarts.
    """
    timed = [c for c in members if is_clock(c.name, stated_unit(c.name, c.unit))]
    named = [c for c in members if c.master] or sorted(timed, key=lambda c: not is_clock(c.name))
    named += [c for c in file.listed if is_clock(c.name) and c not in members and _same_rows(c, members[0])]
    for clock in named:
        time = file.columns([clock])[0]
        if time is not None and (rises(time) or (clock.master and not restarts(time))):
            stated = stated_unit(clock.name, clock.unit) or ("s" if clock.master else "")
            unit, source = clock_unit(clock.name, stated, time)
            return clock, clock_seconds(time, unit), unit, source
    return None, None, "", "file"


def _recorded(
    channel: StoredChannel, values: Array | None, time: Array | None, unit_from: UnitFrom = "file"
) -> Recorded:
    unit = stated_unit(channel.name, channel.unit) or channel.unit
    info = channel_info(channel.name, unit, time, values, channel.group, channel.source)
    return Recorded(replace(info, begin=channel.begin, unit_from=unit_from), time, values)


def _chosen(
    listed: Sequence[StoredChannel], mapping: Mapping[str, Column], name: str
) -> tuple[dict[str, StoredChannel], list[Finding], list[Finding]]:
    """The file's channel for each mapped channel, findings, and problems."""
    chosen: dict[str, StoredChannel] = {}
    findings: list[Finding] = []
    problems: list[Finding] = []
    for channel, column in mapping.items():
        fitting = _fitting(listed, column)
        if channel == "time" and fitting and (column.group or all(c.master for c in fitting)):
            fitting = fitting[:1]  # all clocks of a file count from the same moment
        if channel == "time" and len(fitting) > 1:
            fitting = fitting[:1]  # each channel takes the clock of its own group
        if wrong := unit_problem(column, name):
            problems.append(wrong)
        elif len(fitting) == 1:
            chosen[channel] = fitting[0]
            place = f"{name}, column '{fitting[0].name}'"
            unit = stated_unit(fitting[0].name, fitting[0].unit)
            doubts = [contradiction(place, channel, column, unit)] if contradicts(unit, column) else []
            # A clock in a wrong unit makes every rate wrong, and no other check detects it.
            (problems if channel == "time" and not column.of_run else findings).extend(doubts)
            findings += [] if unit else contradicted_name_end(place, fitting[0].name, channel, column)
        elif fitting:
            problems.append(_several(column, channel, fitting, name))
        elif column.optional:
            what = f"channel '{channel}' is left out: no column '{column.column}'"
            findings.append(Finding(name, what, remedy=_instead(listed, column)))
        else:
            what = f"channel '{channel}': no such column in {name}"
            got = repr(column.column) + "".join(f" of {k} {v!r}" for k, v in _where(column).items())
            problems.append(MissingColumn(column.where or name, what, got, _instead(listed, column), channel=channel))
    return chosen, findings, problems


def _where(column: Column) -> dict[str, str]:
    return {k: v for k, v in (("group", column.group), ("source", column.source)) if v}


def _fitting(listed: Sequence[StoredChannel], column: Column) -> list[StoredChannel]:
    """The channels with a column's name, or group and name joined by a dot, in its group and source."""
    within = [c for c in listed if column.group in ("", c.group) and column.source in ("", c.source)]
    wanted = " ".join(column.column.split())
    by_name = positions([" ".join(c.name.split()) for c in within], wanted)
    return [within[i] for i in by_name or positions([c.path for c in within], wanted)]


def _several(column: Column, channel: str, fitting: Sequence[StoredChannel], name: str) -> Finding:
    what = f"channel '{channel}': {len(fitting)} channels of this name in {name}"
    for key in ("group", "source"):
        values = [getattr(c, key) for c in fitting]
        if len(set(values)) == len(values) and all(values):
            return Finding(column.where or name, what, repr(column.column), f"add {key}: {_either(values)}")
    names = [f"{column.column}#{n + 1}" for n in range(len(fitting))]
    return Finding(column.where or name, what, repr(column.column), f"write column: {_either(names)}")


def _either(values: Sequence[str]) -> str:
    shown = " or ".join(f"'{v}'" for v in values[:3])
    return shown + (f" ({len(values)} in all)" if len(values) > 3 else "")


def _instead(listed: Sequence[StoredChannel], column: Column) -> str:
    where = _where(column)
    elsewhere = _fitting(listed, replace(column, group="", source="")) if where else []
    if elsewhere:
        return "; ".join(f"its {key} is {_either([getattr(c, key) for c in elsewhere])}" for key in where)
    within = [c for c in listed if column.group in ("", c.group) and column.source in ("", c.source)]
    return closest_names(_written(within or listed), column.column)


def _written(listed: Sequence[StoredChannel]) -> list[str]:
    """The names of the channels; clocks of several tables, and equal names in different groups, are listed once."""
    names: dict[str, list[StoredChannel]] = {}
    for channel in listed:
        names.setdefault(channel.name, []).append(channel)
    plain = {n for n, same in names.items() if all(c.master for c in same) or len({c.group for c in same}) == len(same)}
    return [n for n, same in names.items() for _ in (same[:1] if n in plain else same)]


def _clock(listed: Sequence[StoredChannel], stored: StoredChannel, time: Column, name: str) -> StoredChannel:
    """The clock of a channel: the column mapped as time in its table, the table's master, or one with as many rows.

    Raises
    ------
    InputError : the channel has no clock, or several.
    """
    called = _fitting(listed, replace(time, group="", source=""))
    own = [c for c in called if c.table == stored.table]
    if not own and any(c.master for c in called):
        own = [c for c in listed if c.master and c.table == stored.table]
    own = own or [c for c in called if _same_rows(c, stored)]
    if len(own) > 1:
        own = [c for c in own if c.group == (time.group or stored.group)]
    if len(own) == 1:
        return own[0]
    place = f"{name}, column '{stored.path}'"
    what = "has several clocks" if own else f"has no clock: there is no column '{time.column}' for it"
    clocks = [c.path for c in listed if (c.master or is_clock(c.name)) and c.table == stored.table]
    remedy = f"map time to {_either(clocks)}" if clocks else "export the channel together with its time"
    raise InputError(Finding(place, what, remedy=remedy))


def _same_rows(clock: StoredChannel, stored: StoredChannel) -> bool:
    """Whether two tables have the same number of rows, if their keys end with it."""
    return isinstance(clock.table, tuple) and isinstance(stored.table, tuple) and clock.table[-1:] == stored.table[-1:]


def _text_options(options: ReadOptions, name: str) -> Iterator[Finding]:
    for key in ("delimiter", "decimal", "encoding", "header_row"):
        if getattr(options, key) is not None:
            what = f"'reading: {key}' applies to text logs only, and this is not one"
            yield Finding(name, what, repr(getattr(options, key)), "remove it")


def _on_its_clock(
    file: StoredFile,
    clock: StoredChannel,
    chosen: Mapping[str, StoredChannel],
    mapping: Mapping[str, Column],
    options: ReadOptions,
    name: str,
) -> Log | tuple[Finding, ...]:
    """The log of the channels on one clock, or the problems."""
    place = f"{name}, column '{clock.path if len(chosen) else clock.name}'"
    time, *values = _columns(file, [clock, *chosen.values()])
    channels: dict[str, Array] = {}
    problems: list[Finding] = []
    findings: list[Finding] = []
    for (channel, stored), column in zip(chosen.items(), values, strict=True):
        if column is not None:
            channels[channel] = column
            continue
        found = Finding(f"{name}, column '{stored.name}'", "contains no numbers", remedy="map another column")
        if mapping[channel].optional:
            findings.append(replace(found, remedy=f"channel '{channel}' is left out"))
        else:
            problems.append(found)
    if time is None:
        problems.append(Finding(place, "contains no numbers", remedy="export the time as seconds"))
    elif np.count_nonzero(np.isfinite(time)) < 2:
        problems.append(Finding(place, "fewer than two samples", remedy="export the log again, with its data"))
    if problems or time is None:
        return tuple(problems)
    del values
    columns = {"time": clock.name, **{c: s.name for c, s in chosen.items()}}
    log = _rising(
        time, channels, mapping["time"], options, LogSource(columns, partial(file.line, clock), (), file.row), name
    )
    return replace(log, findings=(*findings, *log.findings), begin=clock.begin)


def _rising(
    time: Array, channels: Mapping[str, Array], clock: Column, options: ReadOptions, source: LogSource, name: str
) -> Log:
    """The log with the rows whose time increases, or those of a table of split times in order of time."""
    place = f"{name}, column '{source.columns['time']}'"
    rows: Rows | None = None
    problems: tuple[Finding, ...] = ()
    if options.recording is not None:
        own = recording_rows(time, options.recording, place)
        rows, time = np.arange(time.size)[own], time[own]
        channels = {channel: values[own] for channel, values in channels.items()}
    if options.split_times is not None:
        table = split_instants(time, options.split_times, place)
        rows, time, problems = table.rows if rows is None else rows[table.rows], table.time, table.problems
        channels = {channel: values[table.rows] for channel, values in channels.items()}
    line_of = source.line_of if rows is None else partial(_number, source, rows)
    rising = check_rising(clock.in_si(time), options.clock, place, line_of, source.row, channels)
    if rising.kept is not None:
        kept = np.flatnonzero(rising.kept)
        time, rows = time[kept], kept if rows is None else rows[kept]
        channels = {channel: values[kept] for channel, values in channels.items()}
    if rows is not None:
        line_of = partial(_number, source, rows)
    read = replace(source, line_of=line_of, problems=(*problems, *rising.problems))
    return Log(name, clock.in_si(time), channels, rising.findings, read)


def _number(source: LogSource, rows: Rows, row: int) -> int:
    return source.line_of(int(rows[row]))


def _columns(file: StoredFile, wanted: Sequence[StoredChannel]) -> list[Array | None]:
    """Columns of one table, or of two tables with the same rows."""
    tables = dict.fromkeys(c.table for c in wanted)
    found: dict[Hashable, Array | None] = {}
    for table in tables:
        members = list({c.at: c for c in wanted if c.table == table}.values())
        found.update(zip((c.at for c in members), file.columns(members), strict=True))
    return [found[c.at] for c in wanted]
