"""What each cut changed in the parameters: the baseline fitted again without it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.project.inputs import Inputs, summed
from vdyn_cli.project.run_parts import bridged
from vdyn_cli.quantities.cut_ledger import DataQuality, LedgerRow
from vdyn_cli.quantities.errors import VdynError
from vdyn_cli.quantities.quality_flags import EVERY
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps import Failure, Step, published


def with_changes(step: Step, inputs: Inputs, quality: DataQuality, baseline: Result) -> DataQuality:
    """The quality whose ledger says how each cut shifted the baseline's parameters.

    Not evaluated where the baseline is not published, where a fit is expensive (a step that is linearized once), for
    cuts at which a run was split, and beyond the ``most_refits`` longest cuts.
    """
    costly = step.diagnosable is None or step.diagnosable.linearized(inputs.spec)
    split = (EVERY, *step.complete, *step.unbroken) if step.complete or step.unbroken else ()
    cuts = [
        r
        for r in quality.ledger
        if r.decision != "kept" and not (r.channel in split and r.stop - r.start > QUALITY.longest_bridge)
    ]
    if baseline.refused or costly or step.load is not None or not cuts:
        return quality
    longest = sorted(cuts, key=lambda r: -r.samples)[: QUALITY.most_refits]
    ledger = [_evaluated(step, inputs, r, baseline) if any(r is one for one in longest) else r for r in quality.ledger]
    return replace(quality, ledger=tuple(ledger))


def _evaluated(step: Step, inputs: Inputs, row: LedgerRow, baseline: Result) -> LedgerRow:
    changes = _shifts(step, inputs, row, baseline)
    return row if changes is None else replace(row, changes=changes)


def _shifts(step: Step, inputs: Inputs, row: LedgerRow, baseline: Result) -> Mapping[str, float] | None:
    """The parameters with the cut less those without it; None where there is no result without it."""
    logs = tuple(
        bridged(summed(step, one.without(row)), one.whole, step.complete)
        if any(r is row for r in one.ledger)
        else one.log
        for one in inputs.cut
    )
    try:
        found = published(step.prepare(inputs.spec, logs, inputs.known))
    except (VdynError, ArithmeticError, ValueError):
        return None
    if isinstance(found, Failure):
        return None
    ours, theirs = baseline.parameters.estimates, found.parameters.estimates
    return {n: ours[n].value - theirs[n].value for n in ours if n in theirs and ours[n].source == step.name}
