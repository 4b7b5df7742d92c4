"""The channels of one recording of a file in which the clock restarts with each of several recordings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise

import numpy as np

from vdyn_cli.io.clocks.appended_recordings import recording_rows, restarts
from vdyn_cli.io.clocks.clock_unit import clock_unit
from vdyn_cli.io.reader import Recorded, channel_info, clock_seconds, is_clock, late_rows, rises, rises_but_for
from vdyn_cli.quantities.arrays import Array


def one_recording(channels: Iterator[Recorded], number: int) -> Iterator[Recorded]:
    """The channels of a file, those of a table whose clock restarts with the samples of one recording only.

    Parameters
    ----------
    channels : every channel of the file. number : of the recording, counted from 1.
    """
    without_clock: list[Recorded] = []
    for channel in channels:
        if channel.time is None:
            without_clock.append(channel)
            continue
        yield from _selected(without_clock, number)
        without_clock = []
        yield channel
    yield from _selected(without_clock, number)


def _selected(channels: Sequence[Recorded], number: int) -> list[Recorded]:
    tables: dict[tuple[str, int], list[int]] = {}
    for i, channel in enumerate(channels):
        size = channel.values.size if channel.values is not None else 0
        tables.setdefault((channel.info.group, size), []).append(i)
    selected = list(channels)
    for members in tables.values():
        for i, channel in zip(members, _of_table([channels[i] for i in members], number), strict=True):
            selected[i] = channel
    return selected


def _of_table(channels: Sequence[Recorded], number: int) -> Sequence[Recorded]:
    timed = [c for c in channels if c.values is not None and is_clock(c.info.name, c.info.unit)]
    for clock in sorted(timed, key=lambda c: not is_clock(c.info.name)):
        values = clock.values
        begins = [0, *restarts(values), values.size] if values is not None else []
        if values is None or not 2 < len(begins) > number:
            continue
        own = recording_rows(values, number, clock.info.name)
        unit, unit_from = clock_unit(clock.info.name, clock.info.unit, values[own])
        seconds = clock_seconds(values, unit)
        raw, late = seconds[own], rises_but_for(seconds[own])
        if not (rises(raw) or late):
            continue
        time = np.where(late_rows(raw), np.nan, raw) if late else raw
        parts = [seconds[a:b] for a, b in pairwise(begins)]
        spans = tuple((float(np.nanmin(part)), float(np.nanmax(part))) for part in parts)
        info = replace(clock.info, unit=unit, unit_from=unit_from, late=late, recordings=spans)
        told = replace(clock, info=info)
        return [_cut(told if c is clock else c, own, time, clock is c) for c in channels]
    return channels


def _cut(channel: Recorded, own: slice, time: Array, is_its_clock: bool) -> Recorded:
    values = time if is_its_clock else None if channel.values is None else channel.values[own]
    found = channel_info(channel.info.name, channel.info.unit, time, values)
    return Recorded(replace(channel.info, rate=found.rate, span=found.span), time, values)
