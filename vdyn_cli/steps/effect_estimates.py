"""Sizes of the effects that a fit has in its model: free for a look at all of them, and for the result's document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

import numpy as np

from vdyn_cli.inference import Solution, Unknown

NORMAL95 = 1.96


def unbounded(extra: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """The unknowns without their ranges: a fit with all effects in, meant for its residuals, may leave them."""
    return tuple(replace(u, lower=-np.inf, upper=np.inf) for u in extra)


def sizes_found(
    solution: Solution, extra: Sequence[Unknown], spreads: Mapping[str, float] = MappingProxyType({})
) -> Mapping[str, Any]:
    """``{"effects": {unknown: value, std, interval95}}``, or nothing where the model was not extended.

    What two dozen blocks say of a spread scatters by a sixth and more; what falls below the noise's own share is luck,
    and that share takes its place. So do ``spreads``, by unknown, that a step knows to be larger.
    """
    least = dict(zip(solution.names, np.sqrt(np.diag(solution.classical_covariance)).tolist(), strict=True))
    least = {n: max(s, spreads.get(n, 0.0)) for n, s in least.items()}
    found = {}
    for u in extra:
        value, std, (low, high) = solution.values[u.name], solution.std[u.name], solution.interval95[u.name]
        half = NORMAL95 * least[u.name]
        found[u.name] = {
            "value": value,
            "std": max(std, least[u.name]),
            "interval95": [min(low, value - half), max(high, value + half)],
        }
    return {"effects": found} if found else {}
