"""What a JSON document holds, whoever wrote it: of the wrong kind is as good as absent."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any


def number(value: Any) -> float:
    try:
        return float(value)
    except (TypeError, ValueError):
        return math.nan


def listed(value: Any) -> list[Any]:
    return list(value) if isinstance(value, (list, tuple)) else []


def maps(value: Any) -> list[Mapping[str, Any]]:
    return [v for v in listed(value) if isinstance(v, Mapping)]


def items(value: Any) -> list[tuple[Any, Any]]:
    return list(value.items()) if isinstance(value, Mapping) else []
