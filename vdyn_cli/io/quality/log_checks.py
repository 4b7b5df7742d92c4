"""The checks of every log, for all formats."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vdyn_cli.io.clocks.align import on_one_clock
from vdyn_cli.io.clocks.mixed_rates import split_by_rate
from vdyn_cli.io.clocks.sample_times import check_steps
from vdyn_cli.io.missing_marks import missing_mark
from vdyn_cli.io.quality.channel_quality import WHOLE, Window, check_channel
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log


def checked(log: Log, mapping: Mapping[str, Column], instants: bool = False, window: Window = WHOLE) -> Log:
    """Check the clock and the channels of a log as read, convert it to SI and put all channels on one clock.

    Channels on other clocks are checked as sampled, before they are resampled.

    Parameters
    ----------
    mapping : the column of each channel.
    instants : the times are those of events, as in a table of split times, so that their steps are not checked.
    window : s, first and last time that is used.

    Raises
    ------
    InputError : with the problems of the file and of every required channel.
    """
    begin = log.begin
    log = log if instants else split_by_rate(log)
    others = list(log.source.others) if log.source else []
    problems: list[Finding] = []
    found = [_checked(log, mapping, problems, window, instants)]
    del log
    while others:  # each channel of a large file is freed as soon as it is converted
        found.append(_checked(others.pop(0), mapping, problems, window, beside=True))
    raise_all(dict.fromkeys(problems))
    return replace(on_one_clock(found[0], found[1:]), begin=begin)


def _without_marks(log: Log) -> tuple[Log, list[Finding]]:
    """The log with the marks of missing values replaced by NaN, and a finding for each channel that has some."""
    channels = dict(log.channels)
    findings: list[Finding] = []
    for channel, values in log.channels.items():
        if (mark := missing_mark(values)) is not None:
            count = int(np.count_nonzero(values == mark))
            what = f"channel '{channel}': {count} samples of {mark:.10g} count as missing values"
            findings.append(Finding(log.name, what))
            channels[channel] = np.where(values == mark, np.nan, values)
    return (replace(log, channels=channels), findings) if findings else (log, findings)


def _checked(
    log: Log,
    mapping: Mapping[str, Column],
    problems: list[Finding],
    window: Window,
    instants: bool = False,
    beside: bool = False,
) -> Log:
    """The channels of one clock, checked and in SI; errors are added to ``problems``."""
    own = list(log.source.problems) if log.source else []
    findings = list(log.findings) if own or instants else [*log.findings, *check_steps(log, beside)]
    log, marked = _without_marks(log)
    findings += marked
    for channel in log.channels:
        quality = check_channel(log, channel, mapping[channel].unit, window)
        findings += quality.findings
        if not mapping[channel].optional:
            own += quality.problems
        elif quality.problems:
            findings += [replace(p, remedy=f"channel '{channel}' is left out") for p in quality.problems]
            log = replace(log, channels={k: v for k, v in log.channels.items() if k != channel})
    problems += own
    name, time, written = log.name, log.time, dict(log.channels)
    if own:
        return Log(name, time, {}, tuple(findings))
    del log  # each channel of a large file is freed as soon as it is converted
    channels = {channel: mapping[channel].in_si(written.pop(channel)) for channel in list(written)}
    return Log(name, time, channels, tuple(findings))
