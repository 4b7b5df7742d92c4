"""A clutch that drags in the first seconds of all runs, detected in all runs together and cut from all.

A clutch that disengages T after the start of a coast, or slips with a time constant T, changes the speed to, with d the
additional deceleration::

    V(t) = V0 - a t + b t^2 + d h(t),   0 <= t <= LENGTH,   h = max(T - t, 0)   or   T exp(-t/T)

d is fitted in each run and averaged over the runs of each direction; T and the form of h minimize the residuals of all
runs together. The same fit to later parts of the runs shows how much of d comes from gusts, the road and noise: d at
the start must exceed that scatter, and in both directions, because a slope of the road acts oppositely on them. A brake
that fades lasts longer: it is a candidate effect, and nothing is cut.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.coasts.segments import CoastSegment, KeptAndRejected
from vdyn_cli.steps.coastdown.coasts.start_cuts import from_start, without_starts
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

RELEASED = 6.0  # s at the start of a coast in which a clutch may still slip
LENGTH = 2.0 * RELEASED  # s of a run that are fitted: as long after the latest release as before it
FEWEST_ROWS = 3  # before a release, to show that the speed falls faster there, and after it
GONE = 3.0  # time constants, after which 5 % are left


@dataclass(frozen=True)
class StartDrag:
    """Course of a drag at the start of a coast.

    Parameters
    ----------
    time : s, its end or, where it ``fades``, its time constant. until : s, after which it is negligible.
    """

    time: float
    until: float
    fades: bool = False

    def speed(self, t: Array) -> Array:
        """h(t), (n,) s: speed above the later coast extrapolated back, per unit of the initial deceleration."""
        return np.asarray(self.time * np.exp(-t / self.time) if self.fades else np.maximum(self.time - t, 0.0))


RELEASES = np.geomspace(0.7, RELEASED, 17)  # s, grid with steps of 14 %: the drag has ended at the next value
FADES = np.geomspace(0.5, LENGTH, 8)  # s, grid
DRAGS = (
    *(StartDrag(float(t), float(u)) for t, u in zip(RELEASES, [*RELEASES[1:], RELEASES[-1]], strict=True)),
    *(StartDrag(float(t), GONE * float(t), fades=True) for t in FADES),
)


def drag_at_start(logs: Sequence[Log], directions: Sequence[str | None]) -> tuple[StartDrag, float] | None:
    """The drag of a clutch in all runs and its mean deceleration d, m/s^2; None where it is not significant.

    The mean over directions must exceed its scatter in later parts of the runs by a one-sided Student t test
    (``clutch_chance`` over all courses tried), and ``clutch_least`` in each direction.

    Parameters
    ----------
    logs : the coasts, each from its start. directions : of the runs.
    """
    windows = min((int((log.time[-1] - log.time[0]) // LENGTH) for log in logs), default=0)
    if len(logs) < COASTDOWN_POLICY.clutch_runs or windows < 2:
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
    strong = float(start.mean()) > t_quantile(later.size, 1.0 - COASTDOWN_POLICY.clutch_chance / len(DRAGS)) * error
    return (drag, float(start.mean())) if strong and float(start.min()) > COASTDOWN_POLICY.clutch_least else None


def without_late_clutch(segments: Sequence[CoastSegment]) -> KeptAndRejected:
    """Coasts without the first seconds in which a clutch drags in all of them, and the cut parts."""
    starts = [from_start(one) for one in segments]
    seen = drag_at_start(starts, [s.direction for s in segments])
    if seen is None:
        return list(segments), []
    drag, size = seen
    more = f"{size:.2f} m/s^2 more in their first {drag.time:.1f} s than later"
    why = f"all runs decelerate by {more}: the clutch or the driveline probably still drags"
    return without_starts(segments, starts, drag.until, drag.time, why)


def _fitted(logs: Sequence[Log], begin: float, drag: StartDrag) -> tuple[Array, float] | None:
    """Deceleration d of each run, (r,) m/s^2, and the mean squared residual; None with too few rows.

    Parameters
    ----------
    begin : s after the start of each run, where the fitted ``LENGTH`` begins.
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
