"""Runs of a coast-down that cover only part of the speeds of the other runs, such as one that was broken off."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from vdyn_cli.quantities.errors import Finding
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import falling_speed
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

Range = tuple[float, float]  # lowest and highest speed, m/s


def partial_coasts(segments: Sequence[CoastSegment], names: Mapping[int, str]) -> Iterator[Finding]:
    """A note on each partial coast.

    Parameters
    ----------
    segments : the longest one of each used run. names : of the logs, by the index of the run.
    """
    for one, own, usual, part in _partial(segments):
        passed, others = (f"{3.6 * top:.0f} to {3.6 * bottom:.0f} km/h" for bottom, top in (own, usual))
        share = f"{100 * max(part, 0.0):.0f} %"
        what = f"its longest coast covers {passed}, only {share} of the speeds of the other runs ({others})"
        yield Finding(
            names[one.run], what, "", "if it was broken off, the part is used; a whole run would show all speeds"
        )


def whole_coasts(segments: Sequence[CoastSegment]) -> tuple[CoastSegment, ...]:
    """The segments without the partial coasts, which would limit the speeds over which all runs are compared."""
    left_out = {one.run for one, *_ in _partial(segments)}
    return tuple(s for s in segments if s.run not in left_out)


def _partial(segments: Sequence[CoastSegment]) -> Iterator[tuple[CoastSegment, Range, Range, float]]:
    """Each coast that covers only part of the speeds that most others cover: its range, the usual one, and its share.

    Coasts that are split into speed ranges by plan are not partial: most of the others must cover the same range.
    """
    falls = [falling_speed(s)[1] for s in segments]
    ends = np.array([(v.min(), v.max()) for v in falls])
    for k, one in enumerate(segments):
        others = np.delete(ends, k, axis=0)
        if len(others) < COASTDOWN_POLICY.fewest_alike_coasts:
            return
        low, high = (float(x) for x in np.median(others, axis=0))
        part = (np.minimum(ends[:, 1], high) - np.maximum(ends[:, 0], low)) / (high - low)
        covered = part >= COASTDOWN_POLICY.least_common_speeds
        if not covered[k] and np.delete(covered, k).mean() >= COASTDOWN_POLICY.agreeing_coasts:
            yield one, (float(ends[k, 0]), float(ends[k, 1])), (low, high), float(part[k])
