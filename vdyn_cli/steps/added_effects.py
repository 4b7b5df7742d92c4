"""Effects that are added to a step's model, with the unknowns that are fitted with them."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from vdyn_cli.effects import Effect
    from vdyn_cli.inference import Unknown


@dataclass(frozen=True)
class AddedEffects:
    """Effects that are added to a step's model, with the unknowns that are fitted with them; false without any.

    Parameters
    ----------
    effects : corrections of the model's laws.
    unknowns : shared by all runs, with bounds, priors and start values. An unknown of the effects that is not among
        them keeps its neutral value: zero, or a shape parameter's nominal one.
    """

    effects: tuple[Effect, ...] = ()
    unknowns: tuple[Unknown, ...] = ()

    def __bool__(self) -> bool:
        return bool(self.effects or self.unknowns)

    def __add__(self, others: AddedEffects) -> AddedEffects:
        return AddedEffects((*self.effects, *others.effects), (*self.unknowns, *others.unknowns))

    def without(self, effects: Collection[Effect]) -> AddedEffects:
        """The other effects, with their unknowns."""
        names = {name for effect in effects for name in effect.unknowns}
        others = tuple(e for e in self.effects if e not in effects)
        return AddedEffects(others, tuple(u for u in self.unknowns if u.name not in names))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return tuple(u.name for u in self.unknowns)

    @property
    def covered(self) -> frozenset[str]:
        """Names of the step's own unknowns that the effects replace (``Effect.covers``)."""
        return frozenset(n for e in self.effects for n in e.covers)

    def started_at(self, values: Mapping[str, float]) -> AddedEffects:
        """The effects with their unknowns starting at these values, by name; omitted ones keep their start."""
        return replace(self, unknowns=tuple(replace(u, start=values.get(u.name, u.start)) for u in self.unknowns))


NO_EFFECTS = AddedEffects()
