"""Candidates that are not detectable in the data, and the bias of the parameters if they were present."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vdyn_cli.diagnosis.detection import Detection, Obstacle, obstacle
from vdyn_cli.diagnosis.effect_unknowns import largest_plausible
from vdyn_cli.diagnosis.full_model import FittedModel, FullModel
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.diagnosis.scores import absorbed

NOTICEABLE = 0.01  # standard deviations of a parameter: a smaller bias does not change its last published digit


@dataclass(frozen=True)
class UntestableEffect:
    """A candidate that is not detectable in these data, why, and the parameters' bias if it had this amplitude."""

    effect: str
    obstacle: Obstacle
    visibility: float
    amplitude: float
    would_bias: dict[str, float]


def untestable(model: FullModel, base: FittedModel, found: Detection) -> tuple[UntestableEffect, ...]:
    """The candidates that change the outputs in these data but are not detectable.

    Parameters
    ----------
    base : the fitted baseline. found : scores of the candidates beside it.

    Returns
    -------
    Each with the obstacle, the assumed amplitude, and the bias of the parameters that it would cause.
    """
    result = []
    for name, effect in model.setup.candidates.items():
        unknown = model.amplitudes(name)[0]
        sensitivity = base.system.of([unknown])[:, 0]
        why = obstacle(model, found.scores, name)
        if why is None or not np.any(sensitivity):
            continue
        amplitude = POLICY.typical_share * largest_plausible(effect, unknown)
        moved = absorbed(base.system, model.base, sensitivity) * amplitude
        bias = {
            n: float(m)
            for n, m in zip(model.base, moved, strict=True)
            if n not in model.nuisances and abs(m) > NOTICEABLE * base.solution.std[n]
        }
        result.append(UntestableEffect(name, why, found.scores.visibility[name], amplitude, bias))
    return tuple(result)
