"""The unknowns of a candidate effect in a fit: amplitudes, and the shape parameters beside them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.effects import Effect
from vdyn_cli.inference import Unknown


def amplitudes_of(effect: Effect) -> tuple[str, ...]:
    """Names of the unknowns that the score test frees: all but the shape parameters."""
    return tuple(n for n in effect.unknowns if n not in effect.nominal)


def shapes_of(effect: Effect) -> tuple[str, ...]:
    """Names of the shape parameters (a decay time): free in a fit that has the effect in, else at nominal."""
    return tuple(effect.nominal)


def unknowns_of(effect: Effect, prior: bool = False) -> tuple[Unknown, ...]:
    """An effect's unknowns for a fit, within their plausible range and somewhat beyond.

    A shape parameter stays within its range and has a prior about its nominal value: at zero amplitude no data show it.

    Parameters
    ----------
    prior : give amplitudes a prior about zero, so that all effects of the catalogue can be fitted at once.
    """
    found = []
    for name, quantity in effect.unknowns.items():
        low, high, unit = quantity.lower, quantity.upper, quantity.unit
        if name in effect.nominal:
            nominal = effect.nominal[name]
            found.append(Unknown(name, nominal, low, high, unit, (nominal, POLICY.shape_prior * (high - low))))
            continue
        about_zero = (0.0, POLICY.catalogue_prior * reach(effect, name)) if prior else None
        found.append(Unknown(name, 0.0, POLICY.range_factor * low, POLICY.range_factor * high, unit, about_zero))
    return tuple(found)


def started_at(unknown: Unknown, values: Mapping[str, float]) -> Unknown:
    """The unknown with its start where ``values`` has it, within its range."""
    start = values.get(unknown.name, unknown.start)
    return replace(unknown, start=min(max(start, unknown.lower), unknown.upper))


def reach(effect: Effect, name: str) -> float:
    """The largest plausible magnitude of an unknown, in its unit."""
    quantity = effect.unknowns[name]
    return max(abs(quantity.lower), abs(quantity.upper))
