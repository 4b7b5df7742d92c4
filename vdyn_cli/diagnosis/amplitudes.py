"""Amplitudes of effects as estimates with interval, unit and meaning."""

from __future__ import annotations

from dataclasses import replace

from vdyn_cli.diagnosis.candidate_models import CandidateModel
from vdyn_cli.diagnosis.diagnosis_setup import DiagnosisSetup
from vdyn_cli.effects import Effect
from vdyn_cli.quantities.parameters import Estimate


def fitted_amplitudes(answer: CandidateModel, setup: DiagnosisSetup) -> dict[str, Estimate]:
    """The unknowns of a candidate model's effects, as the diagnosis fitted them.

    Returns
    -------
    Estimates by name of the unknown, each in the unit of that unknown; the effect is the source.
    """
    solution = answer.fitted.solution
    return {
        n: with_meaning(
            Estimate(float(solution.values[n]), float(solution.std[n]), _interval(solution.interval95[n]), "", "", ""),
            effect,
            n,
        )
        for effect in (setup.candidates[e] for e in answer.effects)
        for n in effect.unknowns
        if n in solution.values
    }


def with_meaning(amplitude: Estimate, effect: Effect, name: str) -> Estimate:
    """The estimate with the unit and meaning of the effect's unknown; the effect is its source."""
    quantity = effect.unknowns[name]
    return replace(amplitude, unit=quantity.unit, meaning=quantity.meaning, source=effect.name)


def _interval(ends: tuple[float, float]) -> tuple[float, float]:
    low, high = ends
    return float(low), float(high)
