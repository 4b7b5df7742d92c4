"""Quality flags of every sample of a log, from tests of each channel and of all channels together."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.quality.channel_quality import saturated_spans
from vdyn_cli.io.quality.clock_gaps import clock_gaps
from vdyn_cli.io.quality.level_steps import level_step_fault
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_faults import all_channels_faults, contradicted_command, regular_faults
from vdyn_cli.io.quality.regular_segments import Spans
from vdyn_cli.io.quality.sampled_channel import RADIUS, SPEEDS, SampledChannel, sampled_channel
from vdyn_cli.io.quality.spikes import dropouts, pulses, spikes
from vdyn_cli.quantities.arrays import Array, Mask, Rows
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import EVERY, Fault, Flag, LogFlags
from vdyn_cli.quantities.vocabulary import CHANNELS

_FEWEST_SAMPLES = 50  # samples; a channel with fewer is not tested


def flags(log: Log, units: Mapping[str, str] | None = None) -> LogFlags:
    """The state of every sample of a log's channels, and the faults that the tests found.

    Failed: all channels frozen or linearly interpolated at once; one channel frozen, linearly interpolated or dropped
    out to one value; single-sample spikes. Suspect: a speed or load after a permanent jump, peaks at a sensor's limit,
    the sample after a gap of the clock (channel ``time``). A standstill of the car, coarse quantization and channels
    that may be constant are not faults. A channel with fewer than 50 values is not evaluated.

    Parameters
    ----------
    log : channels in SI, (n,) each, NaN where no value was recorded.
    units : unit of each channel in messages; SI for channels not listed.

    Returns
    -------
    LogFlags : computed in O(n log n) time and O(n) memory for each channel.
    """
    known = {n: (units or {}).get(n, CHANNELS[n].unit) for n in log.channels if n in CHANNELS}
    sampled = [sampled_channel(log, name, known.get(name, "")) for name in log.channels]
    sampled = [s for s in sampled if s.rows.size >= _FEWEST_SAMPLES]
    together = all_channels_faults(log, sampled)
    found = list(together)
    taken = np.zeros(log.time.size, dtype=bool)
    for fault in together:
        taken[fault.first : fault.stop] = True
    wrong = _single_spikes(sampled)
    for channel in sampled:
        alone = list(_alone(channel, taken, log, wrong[channel.name]))
        found += alone or level_step_fault(channel, taken)
        found += _saturated(channel, taken)
    evaluated = {s.name for s in sampled}
    found += _clock_gaps(log)
    states = {n: _states(log[n], n, n in (*evaluated, "time"), found) for n in ("time", *log.channels)}
    return LogFlags(log.name, states, tuple(found))


def _states(values: Array, name: str, evaluated: bool, faults: list[Fault]) -> NDArray[np.uint8]:
    states = np.full(values.size, Flag.GOOD if evaluated else Flag.NOT_EVALUATED, dtype=np.uint8)
    for fault in faults:
        if fault.channel in (name, EVERY):
            part = states[fault.first : fault.stop]
            np.maximum(part, np.uint8(fault.state), out=part)
    states[np.isnan(values)] = Flag.MISSING
    return states


def _single_spikes(sampled: list[SampledChannel]) -> dict[str, Rows]:
    """The single wrong samples of each channel, as indices of its values.

    A spike that another channel of the same unit has in the same row with the same sign and at most twice the size is
    real: both measured it, such as a short torque of the left and the right wheel.
    """
    found = {s.name: spikes(s.values, s.resolution) for s in sampled}
    sizes = {(s.name, int(s.rows[i])): _spike_size(s, i) for s in sampled for i in found[s.name]}
    units = {s.name: s.unit for s in sampled}

    def alone(name: str, row: int) -> bool:
        others = (size for (n, r), size in sizes.items() if r == row and n != name and units[n] == units[name])
        return not any(0.5 <= size / sizes[name, row] <= 2.0 for size in others)

    return {s.name: np.array([i for i in found[s.name] if alone(s.name, int(s.rows[i]))], np.intp) for s in sampled}


def _spike_size(channel: SampledChannel, i: int) -> float:
    values = channel.values
    return float(values[i] - 0.5 * (values[i - 1] + values[i + 1]))


def _alone(channel: SampledChannel, taken: Mask, log: Log, wrong: Rows) -> Iterator[Fault]:
    """The faults of one channel outside of the faults of all channels (``taken``); ``wrong``: its single samples."""
    rows, values = channel.rows, channel.values
    free = ~taken[rows]
    marked = ~free
    jumps = [(a, b) for a, b in dropouts(values) if channel.varies and not _near_rest(channel, a, b)]
    short = pulses(values) if channel.name in ("speed", "vehicle_speed") else []

    def fault(a: int, b: int, test: str, why: str) -> Fault:
        marked[a:b] = True
        return Fault(channel.name, int(rows[a]), int(rows[b - 1]) + 1, test, why)

    for a, b in _free(jumps, free):
        what = f"jumps to {channel.text(values[a])} and back"
        yield fault(a, b, "dropout" if b - a > 1 else "spike", what)
    for a, b in _free([(a, b) for a, b in short if not _near_rest(channel, a, b)], ~marked):
        yield fault(a, b, "dropout", f"jumps by {channel.text(values[a] - values[a - 1], 3, step=True)} and back")
    if not channel.rests and np.ptp(values) > 0.0:
        for a, b, test, why in regular_faults(channel, marked):
            yield fault(a, b, test, why)
    if not (channel.rests or channel.varies):
        for a, b, test, why in contradicted_command(channel, marked, log):
            yield fault(a, b, test, why)
    for i in wrong:
        if not (marked[max(i - 1, 0) : i + 2].any() or _near_rest(channel, i, i + 1)):
            size = _spike_size(channel, i)
            yield fault(
                int(i),
                int(i) + 1,
                "spike",
                f"differs from its neighbors by {channel.text(size, 3, step=True)} for one sample",
            )


def _near_rest(channel: SampledChannel, a: int, b: int) -> bool:
    """Whether a speed jumps at samples a and b between zero and the lowest values that its sensor reads."""
    radius = RADIUS if channel.name.startswith("wheel") else 1.0
    largest = float(np.abs(channel.values[a - 1 : b + 1]).max())
    return channel.name in SPEEDS and largest * radius < QUALITY.lowest_reading


def _clock_gaps(log: Log) -> Iterator[Fault]:
    """The first sample after each gap or jump of the clock, which cannot be distinguished."""
    steps = np.diff(log.time)
    for i in clock_gaps(log.time):
        usual = float(np.median(steps))
        why = f"steps by {steps[i]:.3g} s, typically {usual:.3g} s"
        yield Fault("time", int(i) + 1, int(i) + 2, "clock_gap", why, Flag.SUSPECT)


def _saturated(channel: SampledChannel, taken: Mask) -> Iterator[Fault]:
    """Peaks at the sensor's limit: only suspect, since a command may have reached its own limit."""
    values, rows = channel.values, channel.rows
    for a, b in saturated_spans(values):
        if not taken[rows[a:b]].any():
            why = f"stays at its extreme value, {channel.text(values[a])}"
            yield Fault(channel.name, int(rows[a]), int(rows[b - 1]) + 1, "saturated", why, Flag.SUSPECT)


def _free(found: Spans, free: Mask) -> Spans:
    return [(a, b) for a, b in found if free[a:b].all()]
