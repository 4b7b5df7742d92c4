"""Sizes of causes as estimates with interval, unit and meaning."""

from __future__ import annotations

from collections.abc import Sequence

from vdyn_cli.diagnosis.case import Case
from vdyn_cli.diagnosis.naming import Trial
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.parameters import Estimate


def sizes_of(answer: Trial, case: Case) -> dict[str, Estimate]:
    """The unknowns of an answer's causes, as the diagnosis fitted them."""
    solution = answer.fitted.solution
    return {
        n: estimate_of(case.causes[c], n, solution.values[n], solution.std[n], solution.interval95[n])
        for c in answer.causes
        for n in case.causes[c].unknowns
        if n in solution.values
    }


def estimate_of(effect: Effect, name: str, value: float, std: float, interval95: Sequence[float]) -> Estimate:
    """An unknown of an effect with its unit and meaning; the effect is its source."""
    quantity = effect.unknowns[name]
    low, high = interval95
    return Estimate(float(value), float(std), (float(low), float(high)), quantity.unit, quantity.meaning, effect.name)
