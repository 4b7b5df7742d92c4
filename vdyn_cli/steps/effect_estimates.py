"""Amplitudes of the effects in the model of a fit."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.inference import Solution, Unknown
from vdyn_cli.quantities.parameters import Estimate, normal_interval
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.contract import NO_VALUES

LAW_UNKNOWNS = 3  # most unknowns of a law: an amplitude and two shape parameters


def unbounded(added: AddedEffects) -> AddedEffects:
    """The effects without bounds of their unknowns, for a fit of which only the residuals are used."""
    return replace(added, unknowns=tuple(replace(u, lower=-np.inf, upper=np.inf) for u in added.unknowns))


def is_law(effect: Correction) -> bool:
    """Whether an effect is a law or a learned formula, and not a free function such as a profile or a table."""
    return len(effect.unknowns) <= LAW_UNKNOWNS


def unknowns_of_profiles(effects: Sequence[Correction]) -> dict[str, float]:
    """The unknowns of free profiles among the effects, each with the value 0, for fits that hold them there.

    Readings with noise in several channels are adjusted at a fit. With profiles in it, that fit follows the noise of
    the readings, which then depend on it, and clean logs show errors.
    """
    return {n: 0.0 for effect in effects if not is_law(effect) for n in effect.unknowns}


def effect_amplitudes(
    solution: Solution, unknowns: Sequence[Unknown], least_std: Mapping[str, float] = NO_VALUES
) -> dict[str, Estimate]:
    """The estimates of the unknowns of effects in the model, for ``Result.amplitudes``.

    std = max(std by the scatter across blocks, std by the noise model, least_std). The scatter of two dozen blocks has
    a relative error of a sixth, so that a value below that of the noise model is due to chance.

    Parameters
    ----------
    unknowns : of the effects.
    least_std : by unknown, a lower bound from the step.
    """
    noise, found = solution.classical_std, {}
    for u in unknowns:
        value, (low, high) = solution.values[u.name], solution.interval95[u.name]
        least = max(noise[u.name], least_std.get(u.name, 0.0))
        below, above = normal_interval(value, least)
        interval = min(low, below), max(high, above)
        found[u.name] = Estimate(value, max(solution.std[u.name], least), interval, u.unit, "", "")
    return found
