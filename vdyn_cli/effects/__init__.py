"""The catalogue of candidate effects: one file each, found by itself; adding an effect is adding a file.

An installed package adds one by the entry point ``vdyn.effects: NAME = package.module:NAME``.
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

Kind = Literal["within_run", "between_run"]
GROUP = "vdyn.effects"
EffectLaw = Callable[[Law, Signals, Signals], Number]
_NONE: Mapping[str, float] = MappingProxyType({})

# What an effect is, whatever the test.
PROPERTIES: Mapping[str, str] = MappingProxyType(
    {
        "sensor": "a sensor fault, not a vehicle property",
        "test_only": "belongs to the test, not to the vehicle: later steps and exports do not keep it",
        "between_runs": "shows only as a difference between runs",
        "turns_with_heading": "changes its sign with the direction of driving: only runs both ways separate it",
        "daily": "has another value on another day",
        "beside_drawing": "shows only against a drawing of the part",
        "of_a_car": "its range is that of cars: that of a heavier vehicle is larger in proportion to its mass",
        "over_weight": "its range is a force of cars over their weight: that of a lighter vehicle is larger in turn",
    }
)
# The tests in which an effect is a candidate; a step states those that its test is (Step.situations).
SITUATIONS: Mapping[str, str] = MappingProxyType(
    {
        "open_road": "force balance of a vehicle on an open road",
        "coasting": "the vehicle rolls out in neutral",
        "driving": "the drive torque moves the vehicle",
        "pitching": "axle loads while the vehicle accelerates and brakes",
        "bump_crossing": "vertical motion over an obstacle",
        "wheel_spin": "moment balance of one wheel",
        "free_wheel_spin": "moment balance of one wheel that touches nothing",
        "slip_sweep": "tire force over slip",
        "shaft_twist": "torque and twist of a half-shaft",
    }
)


@dataclass(frozen=True, eq=False)
class Effect:
    """A candidate effect: a correction of an element's law that is exactly nothing when its unknowns are zero.

    Parameters
    ----------
    name : as in the report; the name of its function and file.
    on : the element laws that it corrects; "parameters", an input, a sensor, or ``<sensor>_clock``.
    laws : for each of them ``law(element, s, q)``, which calls the element it corrects; ``s`` are its signals, ``q``
        the unknowns.
    unknowns : each with unit, meaning and the plausible range; the first is the effect's size. A name belongs to one
        effect.
    reference : where law and range come from.
    summary : one sentence for the report.
    nominal : values of the unknowns that shape the effect (a decay time): zero would mean nothing for them, and they
        do nothing while the others are zero.
    states : states of its own and their rates, ``rate(s)``; ``s`` also holds the unknowns. They start at zero.
    probes : sizes of the first unknown from which a fit is started where the derivative at zero is useless.
    label : a noun phrase, "a headwind".
    signature : what it looks like in the data, one sentence.
    alike : effects and parameters with which it can be confused.
    confirm : the cheapest manoeuvre that would show it, one sentence.
    sense : words that follow a value and its unit, such as "along the out direction".
    tags : of PROPERTIES, and the situations in which it is a candidate (of SITUATIONS, or of a step of an installed
        package); without a situation it is a candidate wherever the model calls its laws.
    covers : unknowns of a step that lie within its own: with it in, they stay where they start.
    possible : by unknown, bounds of a fit where a description or a unit can be wrong by more than 1.5 times the
        plausible range: a factor of 3.6 in a speed.
    mistakes : of a scale 1 + e, the factors that a usual mistake makes, each with the mistake: (3.6, "km/h read as
        m/s").
    corrects : the stated parameter that the first unknown corrects, by itself or by a share of it; empty for others.
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
        """The correction of the first law: the effect's own function, whose docstring explains it."""
        return self.laws[self.on[0]]

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
        """Whether it shows within a run, or only between runs."""
        return "between_run" if "between_runs" in self.tags else "within_run"

    @property
    def situations(self) -> frozenset[str]:
        """The situations in which it is a candidate; none: wherever the model calls its laws."""
        return self.tags - PROPERTIES.keys()


def enlarged(effect: Effect, factors: Mapping[str, float]) -> Effect:
    """The effect with the ranges of its amplitudes multiplied, where they are those of a car.

    Parameters
    ----------
    factors : by tag, ``of_a_car`` or ``over_weight``; 1 where the vehicle is one of these cars.
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


# Many parameters, all by keyword: the fields of an effect, so that a file states them as a list.
def effect(
    *,
    on: str | tuple[str, ...],
    unknowns: tuple[Quantity, ...],
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
    """Make a function ``law(element, s, q)`` an effect; it takes the name, and the docstring gives the summary.

    ``on`` names the law, or laws, that the function corrects; ``also`` further laws that other functions correct: the
    same effect may enter two models, or a sensor and an input, in two ways. The rest is Effect's.
    """

    def make(law: EffectLaw) -> Effect:
        own = (on,) if isinstance(on, str) else on
        return Effect(
            name=law.__name__,
            on=(*own, *also),
            laws={**dict.fromkeys(own, law), **also},
            unknowns={quantity.name: quantity for quantity in unknowns},
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
    """Whether a law makes a sensor's reading of the truth; an input's law makes the truth of a reading."""
    return hasattr(s, "sensor")


def candidates(situations: Collection[str] = ()) -> tuple[Effect, ...]:
    """The effects to look for in a test, as far as its model calls their laws.

    ``situations`` are those of the step; a step without any takes every effect.
    """
    return tuple(one for one in catalogue() if not situations or not one.situations or one.situations & set(situations))


def catalogue() -> tuple[Effect, ...]:
    """Every effect of vdyn and of installed packages, in the order of their names.

    Raises
    ------
    ValueError : a file of vdyn does not hold the effect it is named after, or two effects share a name of an unknown.
    """
    return _found()[0]


def refused() -> tuple[Finding, ...]:
    """The effects of installed packages that are left out of the catalogue, and why."""
    return _found()[1]


def extensions_in_si(extensions: Extensions, where: str, problems: list[Finding]) -> dict[str, dict[str, Estimate]]:
    """The effects of a parameter file in SI units; those that this version does not know stay as they are.

    Parameters
    ----------
    where : the file. problems : takes a finding for each unit that is not one of the effect's kind.
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
            raise ValueError(f"effects/{name}.py holds no effect named {name!r}")
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
        entry.refuse(f"holds an effect of another name, {candidate.name!r}", "give both the same name")
    if entry.name in found:
        entry.refuse("has the name of an effect of vdyn", "choose another name")
    if shared:
        entry.refuse(f"shares the unknown {shared[0]!r} with {owner[shared[0]]!r}", "rename the unknown")
    return candidate
