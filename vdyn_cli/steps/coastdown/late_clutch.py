"""A clutch that drags in the first seconds of all runs alike: found by all runs together, and cut from all.

A clutch that lets go T after the start of a coast, or slips with a time constant T, leaves in the speed, with d the
additional deceleration::

    V(t) = V0 - a t + b t^2 + d h(t),   0 <= t <= LENGTH,   h = max(T - t, 0)   or   T exp(-t/T)

d is found in each run and averaged over the runs of each direction; h fits best in all runs together. What gusts, a
road and noise make of d is seen in the later parts of the same runs, fitted in the same way: the start must exceed
their scatter, and in both directions, since a road pushes these oppositely at one place and begins elsewhere for each.
A brake that fades lasts longer: it is an effect, and nothing is cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.segments import CoastSegment, RejectedSegment
from vdyn_cli.steps.coastdown.start_cuts import StartCut, from_start, without_starts
from vdyn_cli.steps.step_policy import STEP_POLICY

RELEASED = 6.0  # s at the start of a coast in which a clutch may still slip
LENGTH = 2.0 * RELEASED  # s of a run that are fitted: as long after the latest release as before it
FEWEST_ROWS = 3  # before a release, which show that the speed falls faster there, and after it
GONE = 3.0  # time constants, after which 5 % are left


@dataclass(frozen=True)
class StartDrag:
    """How a drag at the start of a coast ends.

    Parameters
    ----------
    time : s, when it ends or, where it ``fades``, its time constant. until : s, when it is gone.
    """

    time: float
    until: float
    fades: bool = False

    def speed(self, t: Array) -> Array:
        """Speed over that without it, (n,) s, for a deceleration of one at the start."""
        return np.asarray(self.time * np.exp(-t / self.time) if self.fades else np.maximum(self.time - t, 0.0))


RELEASES = np.geomspace(0.7, RELEASED, 17)  # s, that are tried, 14 % apart: it is gone at the next
FADES = np.geomspace(0.5, LENGTH, 8)  # s, that are tried
DRAGS = (
    *(StartDrag(float(t), float(u)) for t, u in zip(RELEASES, [*RELEASES[1:], RELEASES[-1]], strict=True)),
    *(StartDrag(float(t), GONE * float(t), fades=True) for t in FADES),
)


def drag_at_start(logs: Sequence[Log], directions: Sequence[str | None]) -> tuple[StartDrag, float] | None:
    """The drag of a clutch in all runs with its deceleration, m/s^2; None where there is none.

    Parameters
    ----------
    logs : the coasts, each from its start. directions : of the runs.
    """
    from scipy.special import stdtrit

    windows = min((int((log.time[-1] - log.time[0]) // LENGTH) for log in logs), default=0)
    if len(logs) < STEP_POLICY.clutch_runs or windows < 2:
        return None
    tried = [(fits[1], drag, fits[0]) for drag in DRAGS if (fits := _fitted(logs, 0.0, drag)) is not None]
    if not tried:
        return None
    _, drag, found = min(tried, key=lambda t: t[0])
    if drag.until > RELEASED:
        return None
    ways = [np.array([str(d) == way for d in directions]) for way in sorted({str(d) for d in directions})]
    start = np.array([found[way].mean() for way in ways])
    others = [_fitted(logs, k * LENGTH, drag) for k in range(1, windows)]
    later = np.array([other[0][way].mean() for other in others if other is not None for way in ways])
    if not later.size:
        return None
    error = float(np.sqrt(np.mean(later**2) / len(ways)))
    strong = float(start.mean()) > float(stdtrit(later.size, 1.0 - STEP_POLICY.clutch_chance / len(DRAGS))) * error
    return (drag, float(start.mean())) if strong and float(start.min()) > STEP_POLICY.clutch_least else None


def without_late_clutch(
    segments: Sequence[CoastSegment],
    logs: Sequence[Log],
    directions: Sequence[str | None],
    kept: Sequence[Sequence[tuple[float, float]]],
) -> tuple[list[CoastSegment], list[RejectedSegment]]:
    """Coasts without the first seconds in which a clutch drags in all of them alike, and what was cut.

    Parameters
    ----------
    logs : of each segment's run, whole. directions : of each segment. kept : spans (s, s) that must not be cut.
    """
    starts = [from_start(one.log, log) for one, log in zip(segments, logs, strict=True)]
    seen = drag_at_start(starts, directions)
    if seen is None:
        return list(segments), []
    drag, size = seen
    why = f"all runs slow by {size:.2f} m/s^2 more in their first {drag.time:.1f} s than later: clutch or driveline?"
    return without_starts(segments, starts, kept, StartCut(drag.until, drag.time, why))


def _fitted(logs: Sequence[Log], begin: float, drag: StartDrag) -> tuple[Array, float] | None:
    """Deceleration d of each run, (r,) m/s^2, and the mean square that is left; None where rows are too few.

    Parameters
    ----------
    begin : s after the start of each run, where ``LENGTH`` begins.
    """
    found, left = np.empty(len(logs)), np.empty(len(logs))
    for k, log in enumerate(logs):
        time = log.time - log.time[0] - begin
        inside = (time >= 0.0) & (time <= LENGTH)
        t, speed = time[inside], log["speed"][inside]
        if min(int(np.sum(t < drag.time)), int(np.sum(t > drag.time))) < FEWEST_ROWS:
            return None
        design = np.column_stack([np.ones_like(t), t, t**2, drag.speed(t)])
        values = np.linalg.lstsq(design, speed, rcond=None)[0]
        found[k], left[k] = values[3], float(np.mean((speed - design @ values) ** 2))
    return found, float(left.mean())
