"""Causes that the data cannot show, and what they would do to the parameters if they were there."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.detect import Detection, Unseen, unseen
from vdyn_cli.diagnosis.scores import absorbed
from vdyn_cli.diagnosis.workbench import Fitted, Workbench

NOTICEABLE = 0.01  # standard deviations: a bias below is not worth a word
TYPICAL = 0.5  # of the plausible range


@dataclass(frozen=True)
class Invisible:
    """A cause that these data cannot show, why, and what it would do to the parameters if it were there."""

    effect: str
    because: Unseen
    visibility: float
    size: float
    would_bias: dict[str, float]


def invisible(bench: Workbench, base: Fitted, found: Detection) -> tuple[Invisible, ...]:
    """Every cause of the catalogue that would leave a trace but cannot be seen in it."""
    result = []
    for name, effect in bench.case.causes.items():
        unknown = bench.unknowns(name)[0]
        trace = base.sheet.of([unknown])[:, 0]
        reason = unseen(bench, found.scores, name)
        if reason is None or not np.any(trace):
            continue
        quantity = effect.unknowns[unknown]
        size = TYPICAL * max(abs(quantity.lower), abs(quantity.upper))
        moved = absorbed(base.sheet, bench.base, trace) * size
        spread = base.solution.std
        bias = {
            n: float(m)
            for n, m in zip(bench.base, moved, strict=True)
            if n not in bench.nuisances and abs(m) > NOTICEABLE * spread[n]
        }
        result.append(Invisible(name, reason, found.scores.visibility[name], size, bias))
    return tuple(result)
