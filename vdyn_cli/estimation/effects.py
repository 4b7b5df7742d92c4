"""What an extended fit found of the effects in it, for the result's ``extra``."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from vdyn_cli.fit import Solution, Unknown


def sizes_of(solution: Solution, extra: Sequence[Unknown]) -> dict[str, Any]:
    """``{"effects": {unknown: {value, std, interval95}}}``, or nothing where there are no effects."""
    if not extra:
        return {}
    return {
        "effects": {
            u.name: {
                "value": solution.values[u.name],
                "std": solution.std[u.name],
                "interval95": list(solution.interval95[u.name]),
            }
            for u in extra
        }
    }
