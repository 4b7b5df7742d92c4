"""Warning where the resistance changes over the day, but nothing states when the runs began."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.description.description_model import Run
from vdyn_cli.effects import catalog
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.run_starts import are_assumed


def missing_starts(runs: Sequence[Run], logs: Sequence[Log], found: Diagnosis | None) -> tuple[Finding, ...]:
    """A finding if the diagnosis names a change over the day, by an effect or a curve, and the starts are assumed.

    Parameters
    ----------
    runs, logs : of the description, one log for each run. found : the diagnosis; None without one.
    """
    if found is None or not are_assumed(runs, logs):
        return ()
    named = {cause.effect for cause in found.causes}.union(*found.ambiguous)
    by_curve = found.part is not None and found.part.explains and found.part.coordinate == "elapsed"
    if not by_curve and not any(effect.over_day for effect in catalog() if effect.name in named):
        return ()
    what = "the resistance changes over the day, but no run states 'start': the runs are taken to follow one another "
    what += "without a pause, so that the cause, its size and its time constant are uncertain"
    return (Finding("runs", what, remedy="write 'start' at every run, such as its time of day 10:08"),)
