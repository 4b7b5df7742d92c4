"""Sizes of the effects that a fit has in its model: free for a look at all of them, and for the result's document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from vdyn_cli.fit import Solution, Unknown


def unbounded(extra: Sequence[Unknown]) -> tuple[Unknown, ...]:
    """The unknowns without their ranges: a fit with all effects in, meant for its residuals, may leave them."""
    return tuple(replace(u, lower=-np.inf, upper=np.inf) for u in extra)


def sizes_found(solution: Solution, extra: Sequence[Unknown]) -> Mapping[str, Any]:
    """``{"effects": {unknown: value, std, interval95}}``, or nothing where the model was not extended."""
    found = {
        u.name: {
            "value": solution.values[u.name],
            "std": solution.std[u.name],
            "interval95": list(solution.interval95[u.name]),
        }
        for u in extra
    }
    return {"effects": found} if found else {}
