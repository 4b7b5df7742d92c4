"""The checks that every log passes, whatever its format."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vdyn_cli.io.quality.channel_quality import check_channel
from vdyn_cli.io.reader import Column
from vdyn_cli.io.sample_times import check_steps
from vdyn_cli.quantities.errors import raise_all
from vdyn_cli.quantities.log import Log


def checked(log: Log, mapping: Mapping[str, Column]) -> Log:
    """A log as a reader gives it, with its clock and channels checked, in SI.

    Raises
    ------
    InputError : with the problems of the file and of every channel that is needed.
    """
    problems = list(log.source.problems) if log.source else []
    findings = list(log.findings) if problems else [*log.findings, *check_steps(log)]
    for channel in log.channels:
        quality = check_channel(log, channel, mapping[channel].unit)
        findings += quality.findings
        if not mapping[channel].optional:
            problems += quality.problems
        elif quality.problems:
            findings += [replace(p, remedy=f"channel '{channel}' is left out") for p in quality.problems]
            log = replace(log, channels={k: v for k, v in log.channels.items() if k != channel})
    raise_all(problems)
    name, time, written = log.name, log.time, dict(log.channels)
    del log  # each channel of a large file is freed as soon as it is converted
    channels = {channel: mapping[channel].in_si(written.pop(channel)) for channel in list(written)}
    return Log(name, time, channels, tuple(findings))
