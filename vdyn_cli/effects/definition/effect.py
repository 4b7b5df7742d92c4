"""What a candidate effect is: the correction of a law, its unknowns, and its tags."""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.quantity import Quantity

Kind = Literal["within_run", "between_run"]
EffectLaw = Callable[[Law, Signals, Signals], Number]
_NONE: Mapping[str, float] = MappingProxyType({})

# Properties of an effect that do not depend on the test.
PROPERTIES: Mapping[str, str] = MappingProxyType(
    {
        "sensor": "a sensor fault, not a vehicle property",
        "latency": "the delay or lag of a channel, which every logger has: the extended model corrects it, no fault",
        "test_only": "belongs to the test, not to the vehicle: later steps and exports do not keep it",
        "between_runs": "is visible only as a difference between runs",
        "turns_with_heading": "changes its sign with the direction of driving: only runs both ways separate it",
        "over_day": "changes with the time since the first run: it needs the start of every run",
        "begins_with_run": "acts at the beginning of every run: in runs of one direction a slope there imitates it",
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
        "rolling_wheel_spin": "moment balance of one wheel that rolls on a road",
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
    states : additional states and their rates, ``rate(s)``; ``s`` also contains the unknowns.
    starts : start values of these states, ``start(s)``, likewise, at the first sample; zero where omitted.
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
    gain_of : the channel whose relative gain error is the first unknown; empty for others.
    every_day : standard deviation of the first unknown over test days, of an effect that is never absent, such as
        wind; 0 for others.
    other_law : another form of ``law`` with the same unknowns, where physics does not determine the form: intervals
        include the answer with it.
    """

    name: str
    on: tuple[str, ...]
    laws: Mapping[str, EffectLaw]
    unknowns: Mapping[str, Quantity]
    reference: str
    summary: str
    nominal: Mapping[str, float]
    states: Mapping[str, Callable[[Signals], Number]]
    starts: Mapping[str, Callable[[Signals], Number]]
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
    gain_of: str = ""
    every_day: float = 0.0
    other_law: EffectLaw | None = None

    @property
    def law(self) -> EffectLaw:
        """The correction of the first law: the effect's function, whose docstring explains it."""
        return self.laws[self.on[0]]

    @property
    def turns_with_heading(self) -> bool:
        """Whether only runs in both directions separate it."""
        return "turns_with_heading" in self.tags

    @property
    def over_day(self) -> bool:
        """Whether it changes with the time since the first run."""
        return "over_day" in self.tags

    @property
    def begins_with_run(self) -> bool:
        """Whether a slope of the road where all runs begin imitates it, if they have one direction."""
        return "begins_with_run" in self.tags

    @property
    def sensor(self) -> bool:
        """Whether it is a sensor fault, not a vehicle property."""
        return "sensor" in self.tags

    @property
    def faulty(self) -> bool:
        """Whether it is the error of a sensor that is at fault; a latency is a property of every logger."""
        return self.sensor and not self.latency

    @property
    def latency(self) -> bool:
        """Whether it is the delay or lag of a channel."""
        return "latency" in self.tags

    @property
    def shifts_clock(self) -> bool:
        """Whether it shifts the clock of a sensor, so that outputs are far from linear in its amplitude."""
        return any(law.endswith("_clock") for law in self.on)

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


def in_other_form(effect: Effect) -> Effect | None:
    """The effect with its two laws exchanged; None where it has one."""
    if effect.other_law is None:
        return None
    laws = {on: effect.other_law if law is effect.law else law for on, law in effect.laws.items()}
    return replace(effect, laws=laws, other_law=effect.law)


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
    starts: Mapping[str, Callable[[Signals], Number]] = MappingProxyType({}),
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
    gain_of: str = "",
    every_day: float = 0.0,
    other_law: EffectLaw | None = None,
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
            starts=dict(starts),
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
            gain_of=gain_of,
            every_day=every_day,
            other_law=other_law,
        )

    return make


def reads(s: Signals) -> bool:
    """Whether a law computes a sensor's reading from the true value; the law of an input does the reverse."""
    return hasattr(s, "sensor")
