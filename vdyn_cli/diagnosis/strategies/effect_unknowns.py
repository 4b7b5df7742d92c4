"""The unknowns of a candidate effect in a fit: amplitudes and shape parameters, with bounds, priors and starts."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from types import MappingProxyType

import numpy as np

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Unknown

COARSE = 3  # starts on either side of zero
DELAYS = 4  # likewise, of delays
LOG_STEP = 2.0  # of a scale's logarithm in one step: a factor of 7


def amplitudes_of(effect: Effect) -> tuple[str, ...]:
    """Names of the unknowns that the score test frees: all but the shape parameters."""
    return tuple(n for n in effect.unknowns if n not in effect.nominal)


def shapes_of(effect: Effect) -> tuple[str, ...]:
    """Names of the shape parameters (a decay time): free in a fit with the effect, else at their nominal values."""
    return tuple(effect.nominal)


def unknowns_of(
    effect: Effect, prior: bool = False, holding: Mapping[str, float] = MappingProxyType({})
) -> tuple[Unknown, ...]:
    """An effect's unknowns for a fit, bounded by ``range_factor`` times their plausible range.

    A shape parameter stays within its range and has a prior about its nominal value, since at zero amplitude the data
    do not determine it.

    Parameters
    ----------
    prior : give amplitudes a prior about zero, so that all effects of the catalog can be fitted at once.
    holding : known values; for one beyond the bounds, these are widened to ``open_range``.
    """
    found = []
    for name, quantity in effect.unknowns.items():
        low, high, unit = quantity.lower, quantity.upper, quantity.unit
        if name in effect.nominal:
            nominal = effect.nominal[name]
            found.append(Unknown(name, nominal, low, high, unit, (nominal, POLICY.shape_prior * (high - low))))
            continue
        low, high = bounds_of(effect, name)
        if name not in effect.possible and not low <= holding.get(name, low) <= high:
            low, high = (end * POLICY.open_range / POLICY.range_factor for end in (low, high))
        std = POLICY.catalog_prior * max((largest_plausible(effect, name), *map(abs, effect.possible.get(name, ()))))
        found.append(Unknown(name, 0.0, low, high, unit, (0.0, std) if prior else None))
    return tuple(found)


def started_at(unknown: Unknown, values: Mapping[str, float]) -> Unknown:
    """The unknown started at its value in ``values``, if it has one there, clipped to its bounds."""
    start = values.get(unknown.name, unknown.start)
    return replace(unknown, start=min(max(start, unknown.lower), unknown.upper))


def bounds_of(effect: Effect, name: str) -> tuple[float, float]:
    """Bounds of an amplitude in a fit: its possible range, else ``range_factor`` times its plausible range."""
    quantity = effect.unknowns[name]
    return effect.possible.get(name, (POLICY.range_factor * quantity.lower, POLICY.range_factor * quantity.upper))


def is_scale(effect: Effect, name: str) -> bool:
    """Whether an unknown e enters as a factor 1 + e that may be several times off, for example by a wrong unit."""
    return not effect.unknowns[name].unit and effect.possible.get(name, (-1.0,))[0] > -1.0


def stepped(effect: Effect, name: str, about: float, to: float) -> float:
    """The next point of linearization of an amplitude, from the last one, ``about``, and the fitted value ``to``.

    A scale 1 + e steps in its logarithm, log(1 + e1) = log(1 + e0) + (e1 - e0) / (1 + e0), so that it stays positive:
    a linear fit about e = 0 gives e = -1 for a true scale of one half.
    """
    if is_scale(effect, name):
        scale = 1.0 + about
        to = scale * float(np.exp(np.clip((to - about) / scale, -LOG_STEP, LOG_STEP))) - 1.0
    return float(np.clip(to, *bounds_of(effect, name)))


def coarse_starts(effect: Effect) -> tuple[float, ...]:
    """Amplitudes over the possible range from which a fit is started where the baseline is far off.

    Shares of the range on either side of zero; for a scale 1 + e, equal steps of its logarithm. None for an effect
    without a possible range beyond the plausible one, whose linear fit is close enough.
    """
    first = amplitudes_of(effect)[0]
    if first not in effect.possible:
        return ()
    low, high = bounds_of(effect, first)
    if is_scale(effect, first):
        factors = [POLICY.coarse_factor ** (k + 0.5) for k in range(COARSE)]
        return tuple(f - 1.0 for up in factors for f in (1.0 / up, up) if low < f - 1.0 < high)
    return tuple(end / 1.5 / POLICY.coarse_ratio**k for end in (low, high) if end for k in range(COARSE))


def delay_starts(effect: Effect) -> tuple[float, ...]:
    """Amplitudes, s, from which a fit is also started because the effect shifts a clock; none for other effects.

    The misfit over a delay has several minima where signals oscillate or step: beyond the duration of a step or half a
    period, the derivative at zero says nothing about the delay, and a fit from zero ends in another minimum.
    """
    if not effect.shifts_clock:
        return ()
    low, high = bounds_of(effect, amplitudes_of(effect)[0])
    starts = (POLICY.delay_start * POLICY.delay_factor**k for k in range(DELAYS))
    return tuple(delay for start in starts for delay in (-start, start) if low < delay < high)


def largest_plausible(effect: Effect, name: str) -> float:
    """The largest plausible magnitude of an unknown, in its unit."""
    quantity = effect.unknowns[name]
    return max(abs(quantity.lower), abs(quantity.upper))
