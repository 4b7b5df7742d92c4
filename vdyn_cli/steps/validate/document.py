"""The ``validation`` part of a result's JSON: everything of the tables, for scripts."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from vdyn_cli.steps.validate import views, words
from vdyn_cli.steps.validate.band import Band, Verdict
from vdyn_cli.steps.validate.posterior import Posterior
from vdyn_cli.steps.validate.regression import Weighed


def document(
    w: Weighed, found: tuple[dict[str, Band], ...], told: Mapping[str, Verdict], chance: float, after: Posterior
) -> dict[str, Any]:
    """Verdict, errors by output and regime, what the drives say of each parameter, and the noise."""
    outputs = {}
    parts = views.shares(w, found)
    for name, v in told.items():
        error = np.concatenate([one[name].error for one in found if name in one])
        error = error[np.isfinite(error)]
        outputs[name] = {
            "unit": views.unit_of(name),
            "rms": float(np.sqrt(np.mean(error**2))),
            "bias": float(error.mean()),
            "max": float(np.abs(error).max()),
            "sensor_noise": float(np.median([one[name].sensor for one in found if name in one])),
            "outside": v.share,
            "limit": v.limit,
            "chance": v.chance,
            "regimes": {r: {"outside": a, "limit": b} for r, (a, b) in v.by_regime.items()},
            "shares": {n: round(p, 4) for n, p in list(parts[name].items())[:8]},
        }
    b = w.trial.beliefs
    parameters = {
        n: {
            "before": b.values[n],
            "std_before": float(b.std[i]),
            "after": float(after.values[i]),
            "std_after": float(after.std[i]),
            "strain": float(after.strain[i]),
            "seen": float(after.told[i]),
        }
        for i, n in enumerate(b.names)
    }
    outside = words.outside(told, chance)
    return {
        "verdict": "outside" if outside else "strained" if words.strained(w, after) else "inside",
        "outside": outside,
        "strained": words.strained(w, after),
        "chance": chance,
        "outputs": outputs,
        "parameters": parameters,
        "statistic": {"value": after.statistic, "degrees": after.degrees, "chance": after.chance},
        "noise": dict(w.sizes),
    }
