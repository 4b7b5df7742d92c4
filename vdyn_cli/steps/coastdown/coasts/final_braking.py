"""A short braking at the very end of a coast, which lasts too little for a mean deceleration to show it.

Drivers brake as soon as the test speed is reached, and loggers stop with the car. The deceleration of the 4 s before,
or of six samples at about 1 Hz, is continued over the last 2 s: a speed that falls short of it was lost by a brake or a
gear. Slope, wind and road load change too little in that time.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, KeptAndRejected, RejectedSegment, kept_and_rejected
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

LAST, BEFORE = 2.0, 4.0  # s
FEWEST_IN_LINE = 6  # samples of the line from which the scatter is estimated
LONGEST_BEFORE = 8.0  # s of a slow log, enough for the line at 1 Hz; in a longer time a slope may change like a brake


def without_final_braking(segments: Sequence[CoastSegment]) -> KeptAndRejected:
    """Coasts without the last 2 s, where the speed falls by more than the deceleration before, and those parts."""
    return kept_and_rejected(map(_without_end, segments))


def _without_end(segment: CoastSegment) -> tuple[CoastSegment, list[RejectedSegment]]:
    one, end, lost = segment, float(segment.log.time[-1]), 0.0
    while not any(a <= end <= b for a, b in segment.kept) and (drop := _lost_speed(one)):
        lost += drop
        one = one.rows(one.log.time < one.log.time[-1] - LAST)
    why = (
        f"the speed falls by {3.6 * lost:.1f} km/h more than the deceleration before explains, from "
        f"{3.6 * float(one.log['speed'][-1]):.0f} km/h on: brake or gear?"
    )
    return one, [RejectedSegment(segment.name, float(one.log.time[-1]), end, why)] if lost else []


def _lost_speed(segment: CoastSegment) -> float:
    """The speed, m/s, by which the last sample falls short of the line through the samples before the last 2 s.

    Zero where that is below ``brake_loss``, or below ``brake_loss_std`` standard deviations of the line there.
    """
    time, speed = segment.log.time, segment.log["speed"]
    first = time - time[-1]
    step = float(np.median(np.diff(time))) if time.size > 1 else 0.0
    before = min(max(BEFORE, (FEWEST_IN_LINE + 0.5) * step), LONGEST_BEFORE)
    line = (first >= -LAST - before) & (first < -LAST)
    last = first >= -LAST
    rest = int(np.count_nonzero(first < -LAST))
    if (
        segment.split
        or line.sum() < FEWEST_IN_LINE
        or rest < 2 * segment.fewest
        or np.ptp(segment.part[line | last]) > 0
    ):
        return 0.0
    fit, cov = np.polyfit(first[line], speed[line], 1, cov="unscaled")
    scatter = float(np.sqrt(np.sum((speed[line] - np.polyval(fit, first[line])) ** 2) / (line.sum() - 2)))
    lost = float(fit[1] - speed[-1])
    error = scatter * float(np.sqrt(1.0 + cov[1, 1]))
    return lost if lost > max(COASTDOWN_POLICY.brake_loss, COASTDOWN_POLICY.brake_loss_std * error) else 0.0
