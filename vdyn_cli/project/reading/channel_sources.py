"""The source of each channel of a run: a column of its logs, a constant, or another channel times constants."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.description.description_model import Channel, ChannelSource, Description, KnownChannel, Reading
from vdyn_cli.description.yaml_source import Location, YamlSource
from vdyn_cli.io.clocks.tied_channels import ALIGNING
from vdyn_cli.io.reader import COUNTED
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given, Quantity, UnitError, parse
from vdyn_cli.quantities.vocabulary import CHANNELS, PARAMETERS
from vdyn_cli.steps import Step
from vdyn_cli.steps.scaled_channel import ScaledChannel
from vdyn_cli.steps.step_definition import named_channels


@dataclass(frozen=True)
class Scaling:
    """A channel computed from another one, with the constants used.

    Parameters
    ----------
    channel : its source, constants and assumption.
    constants : the estimates of the constants, by name.
    """

    channel: ScaledChannel
    constants: Mapping[str, Estimate]

    @property
    def factor(self) -> float:
        """The product of the constants, SI."""
        return float(np.prod([e.value for e in self.constants.values()]))

    @property
    def relative_std(self) -> float:
        """Relative standard deviation of the factor, for independent constants."""
        return float(np.sqrt(sum((e.std / e.value) ** 2 for e in self.constants.values())))

    def note(self) -> Finding:
        """The finding that states the source and the constants."""
        stated = " and ".join(
            f"{n} {e.value:.5g}{f' +- {e.std:.2g}' if e.std else ''} {e.unit}".rstrip()
            for n, e in self.constants.items()
        )
        per = f", per {self.channel.per}" if self.channel.per else ""
        what = f"is {self.channel.source} times {stated}{per}. {self.channel.assumes}"
        exact = [n for n, e in self.constants.items() if e.std == 0 and n not in self.channel.optional]
        if not exact:
            return Finding(self.channel.target, what.rstrip("."))
        e = self.constants[exact[0]]
        remedy = f"write '{exact[0]}: {e.value:.5g} +- <standard deviation> {e.unit}'"
        return Finding(self.channel.target, f"{what} {' and '.join(exact)} taken as exact", "", remedy)


def channel_maps(spec: Description) -> list[tuple[Mapping[str, Channel | KnownChannel], Location]]:
    """The channels of each logger, and their location in the description; time included that follows from a rate."""
    if not spec.loggers:
        return [(_with_time(spec.channels, spec.reading), ("channels",))]
    return [
        (_with_time(logger.channels, logger.reading), ("loggers", i, "channels"))
        for i, logger in enumerate(spec.loggers)
    ]


def _with_time(channels: Mapping[str, ChannelSource], reading: Reading) -> Mapping[str, Channel | KnownChannel]:
    counted = reading.rate is not None and "time" not in channels
    return {"time": Channel(column=COUNTED.column, unit=COUNTED.unit), **channels} if counted else channels


def logged_channels(channels: Mapping[str, Channel | KnownChannel]) -> dict[str, Channel]:
    """The channels that are read from a column of a log."""
    return {n: c for n, c in channels.items() if isinstance(c, Channel)}


def readable_channels(step: Step, spec: Description) -> dict[str, Quantity]:
    """The channels that a log of the description ``spec`` may contain: those of the step and, where several loggers
    record, those that align the clocks only."""
    aligning = ALIGNING if len(spec.loggers) > 1 else ()
    return {**{n: CHANNELS[n] for n in aligning}, **step.channels()}


def known_channels(step: Step, spec: Description, source: YamlSource, problems: list[Finding]) -> dict[str, float]:
    """The value, SI, of every channel of the description ``spec`` that is stated as a constant.

    Parameters
    ----------
    problems : list to which problems of the constants are added.
    """
    found: dict[str, float] = {}
    quantities = step.channels()
    for channels, at in channel_maps(spec):
        for name, stated in channels.items():
            if isinstance(stated, Channel) or name == "time" or name not in quantities:
                continue
            where, quantity = source.where((*at, name, "constant")), quantities[name]
            try:
                value = parse(stated.constant, quantity.unit).value
            except UnitError as error:
                example = f"constant: 0 {quantity.unit}".rstrip()
                problems.append(Finding(where, str(error), "", f"write it as '{example}'"))
                continue
            if not quantity.allows(value):
                got, remedy = str(stated.constant), "check its unit and sign"
                problems.append(Finding(where, f"channel '{name}' lies outside {quantity.range_text}", got, remedy))
                continue
            found[name] = value
    return found


def scalings(step: Step, spec: Description, known: Parameters) -> tuple[Scaling, ...]:
    """The unmapped channels of the description ``spec`` that are computed from mapped ones.

    Parameters
    ----------
    known : parameters, with the constants of the scales.

    Raises
    ------
    MissingParameterError : a constant is unknown.
    """
    mapped = {n for channels, _ in channel_maps(spec) for n in channels}
    found = []
    for one in step.scaled:
        if one.target in mapped or one.source not in mapped:
            continue
        known.require(*one.constants, where=f"channel '{one.target}' from {one.source}")
        constants = {n: known[n] for n in one.constants}
        settings = {n: Estimate.given(PARAMETERS[n], g.value, g.std) for n, g in _settings(spec, one.optional)}
        constants |= settings | {n: known[n] for n in one.optional if n in known}
        found.append(Scaling(one, constants))
    return tuple(found)


def _settings(spec: Description, names: Sequence[str]) -> Iterator[tuple[str, Given]]:
    """The constants that the step has as a setting: the gear ratio of a shaft's speeds is also that of its torque."""
    for name in names:
        value = getattr(getattr(spec, "settings", None), name, None)
        if isinstance(value, Given):
            yield name, value


def with_known_channels(log: Log, constants: Mapping[str, float], made: Sequence[Scaling]) -> Log:
    """The log with its constant channels and those computed from others.

    Parameters
    ----------
    constants : SI value of each constant channel. made : the computed channels.
    """
    log = log.with_channels(**{n: np.full(log.time.size, value) for n, value in constants.items()})
    for one in made:
        if one.channel.source in log and (not one.channel.per or one.channel.per in log):
            log = log.with_channels(**{one.channel.target: one.factor * log[one.channel.source] / _divisor(one, log)})
            if one.channel.source in log.held:
                log = replace(log, held={**log.held, one.channel.target: log.held[one.channel.source]})
    return log


def _divisor(one: Scaling, log: Log) -> Array | float:
    """The channel by which a computed one is divided, NaN where it is too small; 1 without one."""
    if not one.channel.per:
        return 1.0
    by = log[one.channel.per]
    return np.where(np.abs(by) > one.channel.least, by, np.nan)


def unused_sources(step: Step, spec: Description, source: YamlSource) -> Iterator[Finding]:
    """Findings on mapped channels that are needed only to compute a channel that is mapped, too."""
    own = {n for entry in (*step.required, *step.optional) for n in named_channels(entry)}
    for channels, at in channel_maps(spec):
        for one in step.scaled:
            if one.source in channels and one.target in channels and one.source not in own:
                what = f"channel '{one.source}' is not used: '{one.target}' is mapped"
                yield Finding(source.where((*at, one.source)), what, "", "remove one of them")


def needed_channel(step: Step, names: Sequence[str]) -> str:
    """Text of how to compute one of the needed channels ``names`` from another channel; empty if impossible."""
    for one in step.scaled:
        if one.target in names:
            constants = " and ".join(f"{n} ({PARAMETERS[n].unit or '1'})" for n in one.constants)
            return f", or map '{one.source}' and give {constants} under vehicle"
    return ""
