"""An estimate with its interval, as text."""

from __future__ import annotations

from collections.abc import Mapping

from vdyn_cli.inference.uncertainty_budget import Budget
from vdyn_cli.quantities.number_text import decimals, number
from vdyn_cli.quantities.parameters import Estimate

LISTED = 3  # intervals written out in the result's sentence


def with_interval(estimate: Estimate | Budget, unit: str = "") -> str:
    """``1.2504 kg m^2 (95 %: 1.2489 to 1.2519)``, with the digits that the standard deviation leaves."""
    low, high = (number(end, estimate.std) for end in estimate.interval95)
    return " ".join(filter(None, (number(estimate.value, estimate.std), unit, f"(95 %: {low} to {high})")))


def with_wider_intervals(sentence: str, wide: Mapping[str, Estimate], why: str) -> str:
    """The result's sentence, behind the intervals that are wider than the fit's; unchanged where none is.

    Parameters
    ----------
    wide : the estimates with wider intervals. why : what they contain beside the fit's, such as "with ...".
    """
    if not wide:
        return sentence
    texts = []
    for name, one in list(wide.items())[:LISTED]:
        places = decimals(0.5 * (one.interval95[1] - one.interval95[0]), 12)
        low, high = (f"{end:.{places}f}" for end in one.interval95)
        texts.append(f"{name.replace('_', ' ')} {low} to {high} {one.unit}".strip())
    rest = f" and {len(wide) - LISTED} more" if len(wide) > LISTED else ""
    text = "; ".join(texts)
    return f"{text[:1].upper()}{text[1:]}{rest} (95 %), {why}. By the fit alone: {sentence}"
