"""The catalogue of candidate causes: one file each, found by itself; adding a cause is adding a file."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Literal

from vdyn_cli.engine.bench import Law, Number, Signals
from vdyn_cli.quantity import Quantity

Kind = Literal["within_run", "between_run"]
EffectLaw = Callable[[Law, Signals, Signals], Number]
_NONE: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class Effect:
    """A candidate cause: a correction of one element's law that is exactly nothing when its unknowns are zero.

    Parameters
    ----------
    name : the cause, as in the report; the name of its function and file.
    on : the element law that it corrects; "parameters", an input, a sensor, or ``<sensor>_clock``.
    law : ``law(element, s, q)`` calls the element it corrects; ``s`` are its signals, ``q`` the unknowns.
    unknowns : each with unit, meaning and the plausible range. A name belongs to one effect.
    kind : does it show within a run, or only between runs?
    reference : where law and range come from.
    summary : one sentence for the report.
    nominal : values of the unknowns that shape the effect (a decay time): zero would mean nothing for them, and they
        do nothing while the others are zero.
    states : states of its own and their rates, ``rate(s)``; ``s`` also holds the unknowns. They start at zero.
    probes : sizes of the first unknown from which a fit is started where the derivative at zero is useless.
    """

    name: str
    on: str
    law: EffectLaw
    unknowns: Mapping[str, Quantity]
    kind: Kind
    reference: str
    summary: str
    nominal: Mapping[str, float] = field(default_factory=dict)
    states: Mapping[str, Callable[[Signals], Number]] = field(default_factory=dict)
    probes: tuple[float, ...] = ()


def effect(
    *,
    on: str,
    unknowns: tuple[Quantity, ...],
    reference: str,
    kind: Kind = "within_run",
    nominal: Mapping[str, float] = _NONE,
    states: Mapping[str, Callable[[Signals], Number]] = MappingProxyType({}),
    probes: tuple[float, ...] = (),
) -> Callable[[EffectLaw], Effect]:
    """Make a function ``law(element, s, q)`` an effect; it takes the name, and the docstring gives the summary."""

    def make(law: EffectLaw) -> Effect:
        summary = (law.__doc__ or "").strip().partition("\n")[0]
        named = {quantity.name: quantity for quantity in unknowns}
        return Effect(law.__name__, on, law, named, kind, reference, summary, dict(nominal), dict(states), probes)

    return make


@cache
def catalogue() -> tuple[Effect, ...]:
    """Every effect, in the order of their file names.

    Raises
    ------
    ValueError : a file does not hold the effect it is named after, or two effects share the name of an unknown.
    """
    found: list[Effect] = []
    owner: dict[str, str] = {}
    for name in sorted(info.name for info in pkgutil.iter_modules(__path__)):
        candidate = getattr(import_module(f"{__name__}.{name}"), name, None)
        if not isinstance(candidate, Effect):
            raise ValueError(f"effects/{name}.py holds no effect named {name!r}")
        for unknown in candidate.unknowns:
            if unknown in owner:
                raise ValueError(f"effects {owner[unknown]!r} and {name!r} share the unknown {unknown!r}")
            owner[unknown] = name
        found.append(candidate)
    return tuple(found)
