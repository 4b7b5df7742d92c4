"""The check of a campaign by its step, at the track: of all runs, and of those that need not be repeated."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.project.inputs import Inputs, errors_of_step, placed
from vdyn_cli.quantities.check_schema import CheckedRun, CoastBalance
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.step_definition import TrackCheck


def track_check(inputs: Inputs) -> TrackCheck:
    """The step's check of all runs; empty for a step without one.

    Raises
    ------
    InputError : the step refuses the description.
    """
    with errors_of_step(inputs.step, inputs.source, inputs.logs):
        try:
            return _of_runs(inputs, range(len(inputs.unsplit)))
        except InputError as error:
            found = (placed(f, inputs.spec, inputs.source, inputs.logs) for f in error.findings)
            raise type(error)(*found) from None


def balance_of_kept(inputs: Inputs, coasts: CoastBalance | None, runs: Sequence[CheckedRun]) -> CoastBalance | None:
    """The balance of a campaign without the runs that must be repeated.

    These keep the change that their exclusion made.

    Parameters
    ----------
    coasts : the balance of all runs, if the step has one. runs : the verdict on each.
    """
    used = {r.run for r in coasts.runs if r.mean is not None} if coasts is not None else set[str]()
    again = [k for k, r in enumerate(runs) if r.verdict == "repeat" and r.run in used]
    if coasts is None or not again:
        return coasts
    names, kept = ", ".join(runs[k].run for k in again), [k for k in range(len(runs)) if k not in again]
    try:
        of_kept = _of_runs(inputs, kept).coasts
    except InputError:  # too few runs are left
        of_kept = None
    if of_kept is None:
        said = f"balance, accuracy and limits include the runs to repeat: {names}"
        return coasts.model_copy(update={"sentences": [*coasts.sentences[:1], said, *coasts.sentences[1:]]})
    said = f"balance, accuracy and limits do not include the runs to repeat: {names}"
    rows = {k: row for k, row in zip(kept, of_kept.runs, strict=True)}
    whole = [rows.get(k, row.model_copy(update={"mean": None})) for k, row in enumerate(coasts.runs)]
    sentences = [*of_kept.sentences[:1], said, *of_kept.sentences[1:]]
    return of_kept.model_copy(update={"runs": whole, "sentences": sentences})


def _of_runs(inputs: Inputs, kept: Collection[int]) -> TrackCheck:
    """The step's check of some runs, by their indices; its own indices count these runs."""
    if inputs.step.track_check is None:
        return TrackCheck()
    origin, new = run_of_parts(inputs), {k: i for i, k in enumerate(kept)}
    parts = [i for i, k in enumerate(origin) if k in new]
    spec, data = inputs.spec, inputs.data
    if len(kept) < len(inputs.unsplit):
        spec = spec.model_copy(update={"runs": [spec.runs[i] for i in parts]})
        data = inputs.data_with(tuple(inputs.logs[i] for i in parts))
    whole = tuple(inputs.ready(_bridged(inputs.unsplit[k])) for k in kept)
    return inputs.step.track_check(spec, whole, data, inputs.known, tuple(new[origin[i]] for i in parts))


def _bridged(one: CutLog) -> Log:
    """The log interpolated linearly over its cuts, so that wrong samples do not affect the extent of its run."""
    measured = {name: values for name, values in one.log.channels.items() if name in one.whole}  # others are recomputed
    bridged = {}
    for name, values in measured.items():
        cut, known = np.isnan(values) & ~np.isnan(one.whole[name]), np.isfinite(values)
        if cut.any() and known.any():
            bridged[name] = np.where(cut, np.interp(one.log.time, one.log.time[known], values[known]), values)
    return replace(one.log, channels=measured).with_channels(**bridged)


def run_of_parts(inputs: Inputs) -> tuple[int, ...]:
    """The index of the run of each log; the parts of a run that long cuts split share their ledger."""
    found: list[int] = []
    for i, part in enumerate(inputs.cut):
        again = i > 0 and len(part.ledger) > 0 and part.ledger is inputs.cut[i - 1].ledger
        found.append(found[-1] if again else (found[-1] + 1 if found else 0))
    return tuple(found)
