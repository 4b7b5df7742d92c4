"""The columns of one logger's log in a run: the description's channels, with the run's own columns, signs and units."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from vdyn_cli.description.description_model import OWN, Channel, Description, Run
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.io.file_units import unit_problem
from vdyn_cli.io.reader import Column
from vdyn_cli.project.reading.channel_sources import channel_maps, logged_channels
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.quantity import Quantity


@dataclass(frozen=True)
class LoggerColumns:
    """What is read from one log.

    Parameters
    ----------
    columns : by channel; one with an unknown unit is read in its SI unit, as ``no_unit`` lists it.
    problems : unknown units that the run states; those of the description are reported with its channels.
    """

    columns: Mapping[str, Column]
    no_unit: frozenset[str]
    problems: tuple[Finding, ...]


def logger_columns(
    quantities: Mapping[str, Quantity],
    spec: Description,
    source: YamlSource,
    run: int,
    logger: int,
) -> LoggerColumns:
    """The columns of the log of one logger in a run.

    Parameters
    ----------
    quantities : of the channels that are read. run, logger : their indices in the description ``spec``.
    """
    stated = spec.runs[run]
    entries, where = channel_maps(spec)[logger]
    name = log_names(stated)[logger]
    mapped = {n: _in_run(c, stated, logger, n) for n, c in logged_channels(entries).items()}
    columns = {n: column_of(q, mapped[n], source, (*where, n)) for n, q in quantities.items() if n in mapped}
    units = at_log(("runs", run, "units"), stated, logger)
    own = {n: source.where((*units, n)) for n in columns if n in stated.own("units")[logger]}
    columns |= {n: replace(columns[n], where=place, of_run=True) for n, place in own.items()}
    wrong = {n: f for n, c in columns.items() if (f := unit_problem(c, name)) is not None}
    columns |= {n: replace(columns[n], unit=columns[n].si_unit) for n in wrong}
    return LoggerColumns(columns, frozenset(wrong), tuple(f for n, f in wrong.items() if n in own))


def log_names(run: Run) -> list[str]:
    """The logs of a run as the description names them, one for each logger."""
    return [run.log] if run.log is not None else list(run.logs or [])


def at_log(at: Location, run: Run, logger: int) -> Location:
    """The location of what a run states under its key ``at``, such as ``units``, for the log of one logger."""
    return (*at, logger) if isinstance(getattr(run, str(at[-1])), list) else at


def _in_run(channel: Channel, run: Run, logger: int, name: str) -> Channel:
    """A channel with the column, sign and unit that a run states for it in the log of one logger."""
    own: dict[str, object] = {}
    columns, signs, units = (run.own(key)[logger] for key in OWN)
    if name in columns:
        own["column"] = columns[name]
    if name in signs:
        own["sign"] = channel.sign * signs[name]
    if name in units:
        own["unit"] = units[name]
    return channel.model_copy(update=own)


def column_of(quantity: Quantity, channel: Channel, source: YamlSource, at: Location) -> Column:
    """The column of a log from which a channel is read.

    Parameters
    ----------
    quantity : of the channel. channel : its entry in the description, at the location ``at``.
    """
    place = source.where(at)
    unit, sign, group = channel.unit, channel.sign, channel.group
    return Column(channel.column, unit, quantity.unit, sign, False, place, group, channel.source, channel.scale)
