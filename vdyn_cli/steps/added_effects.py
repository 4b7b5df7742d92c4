"""Effects that are added to a step's model, with the unknowns that are fitted with them."""

from __future__ import annotations

from dataclasses import dataclass
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


NO_EFFECTS = AddedEffects()
