"""Start time of each run, for effects that change over the day, such as warming tires."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from vdyn_cli.description.description_model import Run
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_policy import STEP_POLICY


def run_starts(runs: Sequence[Run], logs: Sequence[Log]) -> tuple[float, ...]:
    """Start of each run's log, (runs,) s after the first one.

    From the key ``start``, if every run states it (``start_findings``). Else from the logs' times, if the logs follow
    one another on one clock. Else logs of a few minutes are assumed to be driven in the order of the description
    without a pause: the warm-up of the tires is then visible, with an uncertain time constant. Longer logs are trips
    and all start at 0.

    Parameters
    ----------
    runs : of the description. logs : one for each run, each with at least one sample.
    """
    stated = [run.start.value for run in runs if run.start is not None]
    if len(stated) == len(runs):
        return tuple(stated)
    first, last = _ends(logs)
    if _on_one_clock(runs, first, last):
        return tuple((first - first.min()).tolist())
    if _are_trips(first, last):
        return (0.0,) * len(runs)
    return (0.0, *np.cumsum(last - first)[:-1].tolist())


def are_assumed(runs: Sequence[Run], logs: Sequence[Log]) -> bool:
    """Whether neither the description nor a clock states the starts, so that the runs are taken to have no pauses."""
    first, last = _ends(logs)
    stated = any(run.start is not None for run in runs)
    return not stated and len(runs) > 1 and not _on_one_clock(runs, first, last) and not _are_trips(first, last)


def _ends(logs: Sequence[Log]) -> tuple[Array, Array]:
    return np.array([log.time[0] for log in logs]), np.array([log.time[-1] for log in logs])


def _on_one_clock(runs: Sequence[Run], first: Array, last: Array) -> bool:
    order = np.argsort(first, kind="stable")
    one_clock = len({run.recordings[0] for run in runs}) == 1  # it restarts with each recording
    return bool(one_clock and np.all(last[order[:-1]] <= first[order[1:]]))


def _are_trips(first: Array, last: Array) -> bool:
    return bool(np.median(last - first) > STEP_POLICY.shortest_trip)


def start_findings(runs: Sequence[Run]) -> tuple[Finding, ...]:
    """A warning where some runs state their start and others do not: then none is used."""
    stated = sum(run.start is not None for run in runs)
    if stated in (0, len(runs)):
        return ()
    what = f"only {stated} of {len(runs)} state 'start', so that it is not used: unless the logs share a clock, the "
    what += (
        "pauses between the runs are unknown, and the diagnosis may confuse a warm-up of the tires with other effects"
    )
    return (Finding("runs", what, "", "write 'start' at every run, such as its time of day 10:08", doubt=True),)
