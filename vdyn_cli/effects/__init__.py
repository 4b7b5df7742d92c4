"""The catalogue of candidate effects: each is a file that the catalogue finds by its name.

An installed package adds an effect with the entry point ``vdyn.effects: NAME = package.module:NAME``.
"""

from __future__ import annotations

import pkgutil
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from functools import cache
from importlib import import_module
from types import MappingProxyType
from typing import Literal

from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.io.plugins import Plugin, plugins
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.parameter_json import in_si
from vdyn_cli.quantities.parameters import Estimate, Extensions
from vdyn_cli.quantities.quantity import Quantity, UnitError

# The file of an effect needs no other imports of the package than these.
__all__ = ["Effect", "Law", "Number", "Quantity", "Signals", "candidates", "catalogue", "effect", "enlarged", "reads"]

Kind = Literal["within_run", "between_run"]
GROUP = "vdyn.effects"
EffectLaw = Callable[[Law, Signals, Signals], Number]
_NONE: Mapping[str, float] = MappingProxyType({})

# Properties of an effect that do not depend on the test.
PROPERTIES: Mapping[str, str] = MappingProxyType(
    {
        "sensor": "a sensor fault, not a vehicle property",
        "test_only": "belongs to the test, not to the vehicle: later steps and exports do not keep it",
        "between_runs": "is visible only as a difference between runs",
        "turns_with_heading": "changes its sign with the direction of driving: only runs both ways separate it",
        "daily": "has a different value on another day",
        "beside_drawing": "is visible only in comparison with a drawing of the part",
        "of_a_car": "its range holds for cars: it increases with the mass of a heavier vehicle",
        "over_weight": "its range is a force of cars divided by their weight: it is larger for a lighter vehicle",
    }
)
# The kinds of test in which an effect is a candidate; a step states those that apply to it (Step.situations).
SITUATIONS: Mapping[str, str] = MappingProxyType(
    {
        "open_road": "force balance of a vehicle on an open road",
        "coasting": "the vehicle coasts in neutral",
        "driving": "the drive torque moves the vehicle",
        "pitching": "axle loads while the vehicle accelerates and brakes",
        "bump_crossing": "vertical motion over an obstacle",
        "wheel_spin": "moment balance of one wheel",
        "free_wheel_spin": "moment balance of one free wheel",
        "slip_sweep": "tire force over slip",
        "shaft_twist": "torque and twist of a half-shaft",
    }
)


@dataclass(frozen=True, eq=False)
class Effect:
    """A candidate effect: a correction of an element's law that vanishes exactly when its unknowns are zero.

    Parameters
    ----------
    name : as in the report; the name of its function and file.
    on : the element laws that it corrects; "parameters", an input, a sensor, or ``<sensor>_clock``.
    laws : for each of them ``law(element, s, q)``, which calls the corrected element; ``s`` are its signals, ``q`` the
        unknowns.
    unknowns : each with unit, meaning and plausible range; the first is the effect's amplitude. No two effects share a
        name of an unknown.
    reference : source of law and range.
    summary : one sentence for the report.
    nominal : values of the shape parameters among the unknowns (a decay time), which may not be zero and have no
        influence while the amplitudes are zero.
    states : additional states and their rates, ``rate(s)``; ``s`` also contains the unknowns. They start at zero.
    probes : start values of the first unknown where the derivative at zero gives no information.
    label : a noun phrase, "a headwind".
    signature : how it appears in the data, one sentence.
    alike : effects and parameters with which it can be confused.
    confirm : the cheapest manoeuvre that would confirm it, one sentence.
    sense : words that follow a value and its unit, such as "along the out direction".
    tags : properties (of PROPERTIES), and the situations in which it is a candidate (of SITUATIONS, or of a step of an
        installed package); without a situation it is a candidate wherever the model calls its laws.
    covers : unknowns of a step that it replaces; with the effect in the model they keep their start values.
    possible : by unknown, bounds of a fit where an error of the description or a unit can exceed 1.5 times the
        plausible range: a factor of 3.6 in a speed.
    mistakes : typical wrong values of a scale 1 + e, each with its cause: (3.6, "km/h read as m/s").
    corrects : the stated parameter that the first unknown corrects, absolutely or relatively; empty for others.
    """

    name: str
    on: tuple[str, ...]
    laws: Mapping[str, EffectLaw]
    unknowns: Mapping[str, Quantity]
    reference: str
    summary: str
    nominal: Mapping[str, float]
    states: Mapping[str, Callable[[Signals], Number]]
    probes: tuple[float, ...]
    label: str
    signature: str
    alike: tuple[str, ...]
    confirm: str
    sense: str
    tags: frozenset[str]
    covers: tuple[str, ...]
    possible: Mapping[str, tuple[float, float]]
    mistakes: tuple[tuple[float, str], ...]
    corrects: str

    @property
    def law(self) -> EffectLaw:
        """The correction of the first law: the effect's function, whose docstring explains it."""
        return self.laws[self.on[0]]

    @property
    def turns_with_heading(self) -> bool:
        """Whether only runs in both directions separate it."""
        return "turns_with_heading" in self.tags

    @property
    def sensor(self) -> bool:
        """Whether it is a sensor fault, not a vehicle property."""
        return "sensor" in self.tags

    @property
    def lasts(self) -> bool:
        """Whether it belongs to the vehicle, so that later steps and exports keep it."""
        return not self.tags & {"sensor", "test_only"}

    @property
    def kind(self) -> Kind:
        """Whether it is visible within a run, or only between runs."""
        return "between_run" if "between_runs" in self.tags else "within_run"

    @property
    def situations(self) -> frozenset[str]:
        """The situations in which it is a candidate; empty: wherever the model calls its laws."""
        return self.tags - PROPERTIES.keys()


def enlarged(effect: Effect, factors: Mapping[str, float]) -> Effect:
    """The effect with the ranges of its amplitudes scaled, if its tags say that they are those of a car.

    Parameters
    ----------
    factors : by tag, ``of_a_car`` or ``over_weight``; 1 for a car.
    """
    factor = max((factors[tag] for tag in effect.tags if tag in factors), default=1.0)
    if factor == 1.0:
        return effect
    larger = {
        name: one if name in effect.nominal else replace(one, lower=factor * one.lower, upper=factor * one.upper)
        for name, one in effect.unknowns.items()
    }
    possible = {name: (factor * low, factor * high) for name, (low, high) in effect.possible.items()}
    return replace(effect, unknowns=larger, possible=possible)


# Many parameters, all by keyword: the fields of an effect, which a file lists.
def effect(
    *,
    on: str | tuple[str, ...],
    unknowns: Quantity | tuple[Quantity, ...],
    reference: str,
    also: Mapping[str, EffectLaw] = MappingProxyType({}),
    nominal: Mapping[str, float] = _NONE,
    states: Mapping[str, Callable[[Signals], Number]] = MappingProxyType({}),
    probes: tuple[float, ...] = (),
    label: str = "",
    signature: str = "",
    alike: tuple[str, ...] = (),
    confirm: str = "",
    sense: str = "",
    tags: Collection[str] = frozenset(),
    covers: tuple[str, ...] = (),
    possible: Mapping[str, tuple[float, float]] = MappingProxyType({}),
    mistakes: tuple[tuple[float, str], ...] = (),
    corrects: str = "",
) -> Callable[[EffectLaw], Effect]:
    """Decorator that makes an effect of a function ``law(element, s, q)``, with its name and first docstring line.

    ``on`` names the laws that the function corrects; ``also`` gives further laws with other functions, because the same
    effect may enter two models, or a sensor and an input, in different ways. The other parameters are those of Effect.
    """

    def make(law: EffectLaw) -> Effect:
        own = (on,) if isinstance(on, str) else on
        every = (unknowns,) if isinstance(unknowns, Quantity) else unknowns
        return Effect(
            name=law.__name__,
            on=(*own, *also),
            laws={**dict.fromkeys(own, law), **also},
            unknowns={quantity.name: quantity for quantity in every},
            reference=reference,
            summary=(law.__doc__ or "").strip().partition("\n")[0],
            nominal=dict(nominal),
            states=dict(states),
            probes=probes,
            label=label or law.__name__.replace("_", " "),
            signature=signature,
            alike=alike,
            confirm=confirm,
            sense=sense,
            tags=frozenset(tags),
            covers=covers,
            possible=dict(possible),
            mistakes=mistakes,
            corrects=corrects,
        )

    return make


def reads(s: Signals) -> bool:
    """Whether a law computes a sensor's reading from the true value; the law of an input does the reverse."""
    return hasattr(s, "sensor")


def candidates(situations: Collection[str] = ()) -> tuple[Effect, ...]:
    """The candidate effects of a test; of these the diagnosis uses those whose laws the model calls.

    ``situations`` : of the step; without any, every effect is a candidate.
    """
    return tuple(one for one in catalogue() if not situations or not one.situations or one.situations & set(situations))


def catalogue() -> tuple[Effect, ...]:
    """Every effect of vdyn and of installed packages, in the order of their names.

    Raises
    ------
    ValueError : a file of vdyn does not define the effect of its name, or two effects share a name of an unknown.
    """
    return _found()[0]


def refused() -> tuple[Finding, ...]:
    """Findings on effects of installed packages that are left out of the catalogue."""
    return _found()[1]


def extensions_in_si(extensions: Extensions, where: str, problems: list[Finding]) -> dict[str, dict[str, Estimate]]:
    """The effects of a parameter file in SI units; effects that this version does not know are unchanged.

    Parameters
    ----------
    where : the file. problems : receives a finding for each unit of a wrong dimension.
    """
    quantities = {name: quantity for one in catalogue() for name, quantity in one.unknowns.items()}
    found: dict[str, dict[str, Estimate]] = {}
    for effect_name, unknowns in extensions.items():
        found[effect_name] = {}
        for name, estimate in unknowns.items():
            try:
                quantity = quantities.get(name)
                found[effect_name][name] = estimate if quantity is None else in_si(estimate, quantity)
            except UnitError as error:
                problems.append(Finding(f"{where}, extension '{effect_name}', '{name}'", str(error)))
    return found


@cache
def _found() -> tuple[tuple[Effect, ...], tuple[Finding, ...]]:
    found: dict[str, Effect] = {}
    owner: dict[str, str] = {}
    for name in sorted(info.name for info in pkgutil.iter_modules(__path__)):
        candidate = getattr(import_module(f"{__name__}.{name}"), name, None)
        if not isinstance(candidate, Effect):
            raise ValueError(f"effects/{name}.py defines no effect named {name!r}")
        for unknown in candidate.unknowns:
            if unknown in owner:
                raise ValueError(f"effects {owner[unknown]!r} and {name!r} share the unknown {unknown!r}")
            owner[unknown] = name
        found[name] = candidate
    refused: list[Finding] = []
    for name, entry in plugins(GROUP).items():
        try:
            candidate = _of_plugin(entry, found, owner)
        except InputError as error:
            refused += error.findings
            continue
        found[name] = candidate
        owner.update(dict.fromkeys(candidate.unknowns, name))
    return tuple(found[name] for name in sorted(found)), tuple(refused)


def _of_plugin(entry: Plugin, found: Mapping[str, Effect], owner: Mapping[str, str]) -> Effect:
    """The effect of an installed package; raises InputError with the package's name."""
    candidate = entry.load(Effect)
    shared = [unknown for unknown in candidate.unknowns if unknown in owner]
    if candidate.name != entry.name:
        entry.refuse(f"defines an effect with a different name, {candidate.name!r}", "give both the same name")
    if entry.name in found:
        entry.refuse("has the name of an effect of vdyn", "choose another name")
    if shared:
        entry.refuse(f"shares the unknown {shared[0]!r} with {owner[shared[0]]!r}", "rename the unknown")
    return candidate
