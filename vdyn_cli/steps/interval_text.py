"""Estimates with their intervals as text."""

from __future__ import annotations

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.number_text import number
from vdyn_cli.quantities.parameters import Estimate


def with_interval(estimate: Estimate | Budget, unit: str = "") -> str:
    """``1.2504 kg m^2 (95 %: 1.2489 to 1.2519)``, with the digits that are significant by the standard deviation."""
    low, high = (number(end, estimate.std) for end in estimate.interval95)
    return " ".join(filter(None, (number(estimate.value, estimate.std), unit, f"(95 %: {low} to {high})")))


def ends(interval: tuple[float, float], scale: float = 1.0) -> str:
    """``0.0092 to 0.0098``, with the digits that are significant by half the interval; ``scale`` converts its unit."""
    low, high = interval
    half = 0.5 * scale * (high - low)
    return f"{number(scale * low, half)} to {number(scale * high, half)}"
