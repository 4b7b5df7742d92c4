"""Sizes of the effects that a fit had in its model, for the result's document."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.fit import Solution, Unknown


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
