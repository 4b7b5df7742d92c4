"""A permanent jump of a speed or a load: its gain or zero differs after it, or it was frozen before it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.io.quality.regular_faults import longest_rest
from vdyn_cli.io.quality.sampled_channel import RADIUS, SPEEDS, SampledChannel
from vdyn_cli.io.quality.spikes import level_step
from vdyn_cli.quantities.arrays import Mask
from vdyn_cli.quantities.quality_flags import Fault, Flag
from vdyn_cli.quantities.vocabulary import CHANNELS

_LOADS = tuple(n for n in CHANNELS if n.endswith(("_load", "force_z")))
_BESIDE = 5.0  # readings between a step of a speed and standstill, before or after it
_AT_REST = 0.05  # share of the step, largest speed at standstill


def level_step_fault(channel: SampledChannel, taken: Mask) -> Iterator[Fault]:
    """A speed or load after a permanent jump; the channel does not show which side of the jump is wrong.

    But a coarse speed that rests and then jumps was frozen. A change across a gap of the clock is no jump within one
    sample.
    """
    if channel.name not in (*SPEEDS, *_LOADS) or taken[channel.rows].any():
        return
    at, steps = level_step(channel.values), np.diff(channel.time)
    if at is not None and steps[at - 1] > (1.0 + QUALITY.longest_step) * float(np.median(steps)):
        return
    if at is not None and channel.moving[at - 1 : at + 1].all() and not _stop_or_start(channel, at):
        jump = channel.values[at] - channel.values[at - 1]
        size = f"jumps by {channel.text(jump, 3, step=True)} within one sample"
        first = at - 1 - int(np.argmin(channel.equal[at - 1 :: -1]))
        held = float(channel.time[at - 1] - channel.time[first])
        if held > QUALITY.varying_rest_ratio * longest_rest(channel, channel.moving, first, at) > 0.0:
            why = f"is constant at {channel.text(channel.values[first])} for {held:.3g} s and then {size}"
            yield Fault(channel.name, int(channel.rows[first]), int(channel.rows[at - 1]) + 1, "frozen", why)
            return
        why = f"{size} and stays: its gain or zero changed"
        yield Fault(channel.name, int(channel.rows[at]), int(channel.rows[-1]) + 1, "level_step", why, Flag.SUSPECT)


def _stop_or_start(channel: SampledChannel, at: int) -> bool:
    """Whether the step of a speed to sample ``at`` is next to a standstill and no faster than tires allow.

    The step's duration counts from the first sample of the previous reading, which may be held.
    """
    if channel.name not in SPEEDS:
        return False
    values, time = channel.values, channel.time
    changes = np.flatnonzero(values[1:at] != values[: at - 1])
    lasted = float(time[at] - time[int(changes[-1]) + 1 if changes.size else 0])
    jump = abs(float(values[at] - values[at - 1]))
    about = np.abs(time - time[at]) <= _BESIDE * lasted
    rests = float(np.abs(values[about]).min()) <= _AT_REST * jump
    radius = RADIUS if channel.name.startswith("wheel") else 1.0
    return rests and radius * jump <= QUALITY.hardest_stop * lasted
