"""A clutch that drags in the first seconds of all runs alike: found by all runs together, and cut from all.

One run shows such a force only where it exceeds what a gust and a road may do. All runs together show less: the excess
of the deceleration over the common law, less that of the run's later part,

    d_ik = e_i(t_k) - mean of e_i over the later part,   t_k = 2, 4, 6 s since the start of run i,

is tested by its scatter between runs. A road pushes the two directions oppositely at one place and begins elsewhere for
each: both must show it. A brake that fades lasts longer: it is an effect, and nothing is cut.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.step_policy import STEP_POLICY

START, AFTER, LATER = slice(0, 3), 3, slice(4, 9)  # intervals of 2 s: a clutch that slips, just released, later


def shared_start(excess: Sequence[Array], directions: Sequence[str | None]) -> int | None:
    """The last interval in which all runs slow down more than later; None where they do not.

    Parameters
    ----------
    excess : of each run, m/s^2 over the common law, at intervals of 2 s since its start. directions : of the runs.
    """
    from scipy.special import stdtrit

    long = [i for i, e in enumerate(excess) if e.size >= LATER.stop]
    if len(long) < STEP_POLICY.clutch_runs or len(long) < len(excess):
        return None
    rows = np.array([excess[i][: LATER.stop] for i in long])
    rows = rows - rows[:, LATER].mean(axis=1, keepdims=True)
    ways = [rows[[d == way for d in directions]] for way in sorted({str(d) for d in directions}) or [""]]
    if any(len(w) == 0 for w in ways):
        ways = [rows]
    degrees = sum(len(w) - 1 for w in ways)
    if degrees < 1:
        return None
    means = np.array([w.mean(axis=0) for w in ways])
    within = sum(((w - w.mean(axis=0)) ** 2).sum(axis=0) for w in ways) / degrees
    error = np.sqrt(within * sum(1.0 / len(w) for w in ways)) / len(ways)
    mean = means.mean(axis=0)
    top = int(np.argmax(mean[START]))
    strong = float(mean[top]) > float(stdtrit(degrees, 1.0 - STEP_POLICY.clutch_chance)) * float(error[top])
    both = float(means[:, top].min()) > STEP_POLICY.clutch_least
    ended = abs(float(mean[AFTER])) < STEP_POLICY.clutch_ended * float(mean[top])
    if not (strong and both and ended):
        return None
    return int(np.flatnonzero(mean[START] > STEP_POLICY.clutch_cut * mean[top])[-1])
