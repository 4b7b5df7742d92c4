"""The shift of the parameters by each cut, from fits of the baseline without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.project.reading.run_parts import bridged
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.data_quality import DataQuality
from vdyn_cli.quantities.errors import VdynError
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, published


def with_changes(inputs: Inputs, baseline: Result) -> DataQuality:
    """The quality of the logs, with the shift of the baseline's parameters by each cut in its ledger.

    Not evaluated if the baseline is not published, if a fit is expensive (a step that is linearized once), for cuts at
    which a run was split, and beyond the ``most_refits`` longest cuts.
    """
    quality, step = inputs.quality, inputs.step
    costly = step.diagnosable is None or step.diagnosable.linearized(inputs.spec)
    split = step.complete or step.unbroken
    cuts = [
        r for r in quality.ledger if r.decision != "kept" and not (split and r.stop - r.start > QUALITY.longest_bridge)
    ]
    if baseline.refused or costly or not cuts:
        return quality
    longest = sorted(cuts, key=lambda r: -r.samples)[: QUALITY.most_refits]
    ledger = [_evaluated(inputs, r, baseline) if any(r is one for one in longest) else r for r in quality.ledger]
    return replace(quality, ledger=tuple(ledger))


def _evaluated(inputs: Inputs, row: LedgerRow, baseline: Result) -> LedgerRow:
    changes = _shifts(inputs, row, baseline)
    return row if changes is None else row.model_copy(update={"changes": changes})


def _shifts(inputs: Inputs, row: LedgerRow, baseline: Result) -> Mapping[str, float] | None:
    """The parameters with the cut minus those without it; None if there is no result without it."""
    logs = tuple(
        bridged(inputs.ready(one.without(row)), inputs.ready(one.whole), inputs.step.complete)
        if any(r is row for r in one.ledger)
        else one.log
        for one in inputs.cut
    )
    try:
        found = published(inputs.step.prepare(inputs.spec, inputs.data_with(logs), inputs.known))
    except (VdynError, ArithmeticError, ValueError):
        return None
    if isinstance(found, Failure):
        return None
    ours, theirs = baseline.parameters.estimates, found.parameters.estimates
    return {n: ours[n].value - theirs[n].value for n in ours if n in theirs and ours[n].source == inputs.step.name}
