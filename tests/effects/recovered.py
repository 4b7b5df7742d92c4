"""What the tests of hidden effects share: the effects in a fit, and the comparison of what was found with the truth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from vdyn_cli.effects import Effect, catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps.added_effects import AddedEffects


def effect(name: str) -> Effect:
    return next(one for one in catalog() if one.name == name)


def added(*effects: Effect) -> AddedEffects:
    """The effects with every unknown, from where a search would begin; shapes with a prior, as in a diagnosis."""
    found = []
    for one in effects:
        for k, (name, q) in enumerate(one.unknowns.items()):
            start = one.probes[0] if one.probes and k == 0 else one.nominal.get(name, 0.0)
            prior = (one.nominal[name], 0.25 * (q.upper - q.lower)) if name in one.nominal else None
            found.append(Unknown(name, start, 1.5 * q.lower, 1.5 * q.upper, q.unit, prior))
    return AddedEffects(effects, tuple(found))


def given(numbers: Mapping[str, float], **std: float) -> Parameters:
    return Parameters({n: Estimate.given(PARAMETERS[n], v, std.get(n, 0.0)) for n, v in numbers.items()})


@dataclass(frozen=True)
class Hidden:
    """An effect of this size in the plant, by the plant's name, and by ours where it has another one."""

    plant: str
    size: float
    ours: str = ""

    @property
    def effect(self) -> Effect:
        return effect(self.ours or self.plant)

    def __str__(self) -> str:
        return self.plant


def compare(result: Result, hidden: Hidden, truth: Mapping[str, float], size: float, near: float) -> None:
    """The size within three standard deviations, and within ``near`` of it; the parameters within four.

    Parameters
    ----------
    size : of the effect's first unknown in the truth. near : relative.
    """
    name = next(iter(hidden.effect.unknowns))
    found = result.amplitudes[name]
    assert abs(found.value - size) < 3 * found.std, (found, size)
    assert abs(found.value - size) < near * abs(size), (found, size)
    assert abs(size) > 4 * found.std, "hidden too small to be seen"
    for parameter, value in truth.items():
        estimate = result.parameters[parameter]
        assert abs(estimate.value - value) < 4 * estimate.std, (parameter, estimate, value)
