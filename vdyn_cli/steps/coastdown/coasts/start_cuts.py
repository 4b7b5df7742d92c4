"""Removal of the first seconds of all coasts for a common reason."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import (
    CoastSegment,
    KeptAndRejected,
    RejectedSegment,
    kept_and_rejected,
    rows,
)

BEFORE = 1.0  # s before a coast within which a log counts as beginning with it: the speed is smoothed over this span


def without_starts(
    segments: Sequence[CoastSegment], starts: Sequence[Log], length: float, slack: float, why: str
) -> KeptAndRejected:
    """Coasts without their start, except those whose start the user keeps, and the cut parts.

    Parameters
    ----------
    starts : of each segment, the log from the start of the coast (``from_start``). length : s, that is cut from it.
    slack : s, by which a span that the user keeps may be shorter at either end of the cut.
    why : a sentence without a period.
    """

    def after(one: CoastSegment, start: Log) -> tuple[CoastSegment, list[RejectedSegment]]:
        begin, until = float(one.log.time[0]), float(start.time[0]) + length
        if any(first <= begin + slack and until - slack <= stop for first, stop in one.kept):
            return one, []
        keep = f"[{{channel: speed, from: {begin:.6g} s, to: {until:.6g} s}}]"
        cut = RejectedSegment(one.name, begin, until, f"{why}. To use it, add 'keep: {keep}' to the run")
        return one.rows(one.log.time > until), [cut]

    return kept_and_rejected(map(after, segments, starts))


def from_start(segment: CoastSegment) -> Log:
    """The coast, extended to the first row of its log where the log begins with the coast.

    A coast begins at the highest smoothed speed, which is half a second after the first row of a log cut there.
    """
    coast, whole = segment.log, segment.whole
    begin, end = float(coast.time[0]), float(coast.time[-1])
    here = np.isfinite(whole["speed"]) & (whole.time <= end)
    return rows(whole, here) if begin - float(whole.time[0]) < BEFORE else coast
