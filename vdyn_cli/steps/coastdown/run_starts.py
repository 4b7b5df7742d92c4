"""When each run began, for effects that change over the day, such as tires that warm up."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.description.test_description import Run
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_policy import STEP_POLICY


def run_starts(runs: Sequence[Run], logs: Sequence[Log]) -> tuple[float, ...]:
    """The start of each run's log after the first one, s.

    By the key ``start`` of the runs, where one has it. Else by the logs' times, where the logs follow one another on
    one clock. Else logs of minutes count as driven in the order of the description without a pause: the warm-up of the
    tires is seen then, and only its time constant is uncertain. Longer logs count as trips, each from its own start.

    Parameters
    ----------
    runs : of the description. logs : one a run, each with at least one sample.
    """
    if any(run.start is not None for run in runs):
        return tuple(run.start.value if run.start is not None else 0.0 for run in runs)
    first, last = (np.array([log.time[k] for log in logs]) for k in (0, -1))
    order = np.argsort(first, kind="stable")
    if np.all(last[order[:-1]] <= first[order[1:]]):
        return tuple((first - first.min()).tolist())
    if np.median(last - first) > STEP_POLICY.shortest_trip:
        return (0.0,) * len(runs)
    return (0.0, *np.cumsum(last - first)[:-1].tolist())
