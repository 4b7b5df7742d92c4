"""The parameters as drives seek them: believed as stated, and free to contradict that."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from vdyn_cli.inference import Unknown
from vdyn_cli.steps.validate.given import Beliefs

SIGNED = ("hub_swing", "driveline_pitch", "rolling_speed")  # may lie on either side of zero
FARTHEST = 200.0  # standard deviations by which drives may contradict what was believed
LEAST = 0.02  # of what was believed
NEAR = 5.0  # standard deviations, within which a simulation begins about what was believed


def believed(beliefs: Beliefs) -> tuple[Unknown, ...]:
    """Every parameter with what is known of it, begun there."""
    return tuple(_believed(beliefs, i) for i in range(len(beliefs.names)))


def near_belief(beliefs: Beliefs, values: Mapping[str, float]) -> dict[str, float]:
    """Those of the values that are parameters', as far as they are possible and not absurd."""
    near = {}
    for u, std in zip(believed(beliefs), beliefs.std.tolist(), strict=True):
        if u.name in values:
            low, high = max(u.lower, u.start - NEAR * std), min(u.upper, u.start + NEAR * std)
            near[u.name] = float(np.clip(values[u.name], low, high))
    return near


def _believed(beliefs: Beliefs, i: int) -> Unknown:
    name, value, std = beliefs.names[i], beliefs.values[beliefs.names[i]], float(beliefs.std[i])
    row = {b: float(beliefs.correlation[i, j]) for j, b in enumerate(beliefs.names) if j != i}
    related = {b: r for b, r in row.items() if abs(r) > 1e-12}
    # Wide: drives may contradict what was believed by any number of standard deviations, which is then a finding.
    low, high = value - FARTHEST * std, value + FARTHEST * std
    if value > 0 and name not in SIGNED:
        low = max(low, LEAST * value)
    return Unknown(name, value, low, high, "", (value, std), nuisance=True, prior_correlation=related)
