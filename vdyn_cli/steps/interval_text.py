"""An estimate with its interval, as text."""

from __future__ import annotations

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.number_text import number
from vdyn_cli.quantities.parameters import Estimate


def with_interval(estimate: Estimate | Budget, unit: str = "") -> str:
    """``1.2504 kg m^2 (95 %: 1.2489 to 1.2519)``, with the digits that the standard deviation leaves."""
    low, high = (number(end, estimate.std) for end in estimate.interval95)
    return " ".join(filter(None, (number(estimate.value, estimate.std), unit, f"(95 %: {low} to {high})")))
