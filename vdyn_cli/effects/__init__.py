"""The catalogue of candidate causes: one file each, found by itself; adding a cause is adding a file."""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Literal

from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity

Kind = Literal["within_run", "between_run"]
EffectLaw = Callable[[Law, Signals, Signals], Number]
_NONE: Mapping[str, float] = MappingProxyType({})


@dataclass(frozen=True, eq=False)
class Effect:
    """A candidate cause: a correction of an element's law that is exactly nothing when its unknowns are zero.

    Parameters
    ----------
    name : the cause, as in the report; the name of its function and file.
    on : the element laws that it corrects; "parameters", an input, a sensor, or ``<sensor>_clock``.
    laws : for each of them ``law(element, s, q)``, which calls the element it corrects; ``s`` are its signals, ``q``
        the unknowns.
    unknowns : each with unit, meaning and the plausible range; the first is the effect's size. A name belongs to one
        effect.
    kind : does it show within a run, or only between runs?
    reference : where law and range come from.
    summary : one sentence for the report.
    nominal : values of the unknowns that shape the effect (a decay time): zero would mean nothing for them, and they
        do nothing while the others are zero.
    states : states of its own and their rates, ``rate(s)``; ``s`` also holds the unknowns. They start at zero.
    probes : sizes of the first unknown from which a fit is started where the derivative at zero is useless.
    label : the cause as a noun phrase, "a headwind".
    signature : what it looks like in the data, one sentence.
    alike : effects and parameters that it can be taken for.
    confirm : the cheapest manoeuvre that would show it, one sentence.
    sensor : a fault of a sensor, not of the car.
    lasts : it belongs to the vehicle, so that later steps and exports keep it; a wind or a slope stays with its day.
    sense : words that follow a value and its unit, such as "along the out direction".
    steps : the steps in which it is looked for; none: wherever the model has its laws.
    covers : unknowns of a step that lie within its own: with it in, they stay where they start.
    """

    name: str
    on: tuple[str, ...]
    laws: Mapping[str, EffectLaw]
    unknowns: Mapping[str, Quantity]
    kind: Kind
    reference: str
    summary: str
    nominal: Mapping[str, float]
    states: Mapping[str, Callable[[Signals], Number]]
    probes: tuple[float, ...]
    label: str
    signature: str
    alike: tuple[str, ...]
    confirm: str
    sensor: bool
    lasts: bool
    sense: str
    steps: tuple[str, ...]
    covers: tuple[str, ...]

    @property
    def law(self) -> EffectLaw:
        """The correction of the first law: the effect's own function, whose docstring explains it."""
        return self.laws[self.on[0]]


def effect(
    *,
    on: str | tuple[str, ...],
    unknowns: tuple[Quantity, ...],
    reference: str,
    also: Mapping[str, EffectLaw] = MappingProxyType({}),
    kind: Kind = "within_run",
    nominal: Mapping[str, float] = _NONE,
    states: Mapping[str, Callable[[Signals], Number]] = MappingProxyType({}),
    probes: tuple[float, ...] = (),
    label: str = "",
    signature: str = "",
    alike: tuple[str, ...] = (),
    confirm: str = "",
    sensor: bool = False,
    lasts: bool = True,
    sense: str = "",
    steps: tuple[str, ...] = (),
    covers: tuple[str, ...] = (),
) -> Callable[[EffectLaw], Effect]:
    """Make a function ``law(element, s, q)`` an effect; it takes the name, and the docstring gives the summary.

    ``on`` names the law, or laws, that the function corrects; ``also`` further laws that other functions correct: the
    same cause may enter two models, or a sensor and an input, in two ways. The rest is Effect's.
    """

    def make(law: EffectLaw) -> Effect:
        own = (on,) if isinstance(on, str) else on
        return Effect(
            name=law.__name__,
            on=(*own, *also),
            laws={**dict.fromkeys(own, law), **also},
            unknowns={quantity.name: quantity for quantity in unknowns},
            kind=kind,
            reference=reference,
            summary=(law.__doc__ or "").strip().partition("\n")[0],
            nominal=dict(nominal),
            states=dict(states),
            probes=probes,
            label=label or law.__name__.replace("_", " "),
            signature=signature,
            alike=alike,
            confirm=confirm,
            sensor=sensor,
            lasts=lasts and not sensor,
            sense=sense,
            steps=steps,
            covers=covers,
        )

    return make


def reads(s: Signals) -> bool:
    """Whether a law makes a sensor's reading of the truth; an input's law makes the truth of a reading."""
    return hasattr(s, "sensor")


def candidates(step: str) -> tuple[Effect, ...]:
    """The effects that a step looks for, as far as its model can take them."""
    return tuple(one for one in catalogue() if not one.steps or step in one.steps)


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
