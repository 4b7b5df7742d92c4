"""Likely amplitudes of nondifferentiable effects, over which the secants of a linearization are taken."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import replace
from functools import partial

from vdyn_cli.effects import Effect
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.added_effects import AddedEffects

LikelySize = Callable[[Effect, Callable[[float], tuple[Unknown, ...]]], tuple[float, float]]


def likely_secants(added: AddedEffects, likely_size: LikelySize) -> dict[str, float]:
    """The likely amplitude of each nondifferentiable effect that starts at zero, if it can be simulated.

    Large play shifts an impact by more than its duration, so that the response to small play says nothing about it.

    Parameters
    ----------
    likely_size : (effect, amplitude -> its unknowns) -> likely amplitude and gain in log likelihood.
    """
    found = {}
    for effect in tried_from_zero(added):
        own = {u.name: u for u in added.unknowns if u.name in effect.unknowns}
        first = next(iter(effect.unknowns))
        with suppress(ResultError):
            found[first], _ = likely_size(effect, partial(_started_at, own, first))
    return found


def tried_from_zero(added: AddedEffects) -> tuple[Effect, ...]:
    """The nondifferentiable effects whose amplitude starts at zero."""
    starts = {u.name: u.start for u in added.unknowns}
    return tuple(e for e in added.effects if e.probes and not starts[next(iter(e.unknowns))])


def _started_at(own: Mapping[str, Unknown], first: str, amplitude: float) -> tuple[Unknown, ...]:
    return tuple(replace(u, start=amplitude) if n == first else u for n, u in own.items())
