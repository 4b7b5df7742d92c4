"""The vehicle that leaves as C: the full model with the causes that were accepted, and every number in it."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

from vdyn_cli.effects import Effect, catalogue
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.c_source import CProgram, c_program
from vdyn_cli.engine.graph import Graph, trace
from vdyn_cli.engine.model import Model
from vdyn_cli.export.given import Cause, Given, completed
from vdyn_cli.export.words import comment, of_parameter, of_signal, of_state
from vdyn_cli.physics.models.vehicle import Driven, vehicle
from vdyn_cli.quantities.quantity import Quantity

STEP = 1e-3  # s, the longest step that resolves half-shafts and wheel hop


@dataclass(frozen=True)
class Machine:
    """A model with its numbers.

    Parameters
    ----------
    model, effects, graph : what is printed.
    values : of every constant of the graph: parameters, causes' unknowns and context, SI.
    quantities : unit and meaning of parameters, inputs, outputs.
    assumed : parameters that nobody gave, and why their value.
    causes : those taken in; ``causes_in_words`` say so, and which were left out, and why.
    driven : the driven axle.
    """

    model: Model
    effects: tuple[Effect, ...]
    graph: Graph
    values: Mapping[str, float]
    quantities: Mapping[str, Quantity]
    assumed: Mapping[str, str]
    causes: tuple[Cause, ...]
    causes_in_words: tuple[str, ...]
    driven: Driven

    @property
    def notes(self) -> tuple[str, ...]:
        """What there is to say of it: every assumption, every cause."""
        return (*(f"assumed {name}: {why}" for name, why in self.assumed.items()), *self.causes_in_words)

    def program(self, name: str, title: str) -> CProgram:
        """The machine in C, with a start speed; steps are the caller's and at most STEP long."""
        comments = {n: comment(of_state(n)) for n in self.graph.states}
        comments |= {n: comment(q) + _doubt(self.assumed.get(n)) for n, q in self.quantities.items()}
        words = (title, f"SI units. Driven: {self.driven}. Steps of at most {STEP:g} s.", *self.causes_in_words)
        return c_program(
            self.graph, 1, name, start=("speed",), defaults=self.values, comments=comments, title="\n   ".join(words)
        )


def machine(given: Given, driven: Driven) -> Machine:
    """The vehicle of a parameter file.

    Raises
    ------
    InputError : parameters that nobody gave and nothing can stand for.
    """
    model = vehicle(driven)
    values, assumed = completed(given, model.parameters, "the full vehicle")
    context = {"heading": 0.0, "temperature": given.values.get("temperature", 293.15)}
    taken, words = accepted(model, given.causes)
    known = {effect.name: effect for effect in catalogue()}
    effects = tuple(known[cause.effect] for cause in taken)
    graph = trace(model, effects)
    unknowns = {name: value for cause in taken for name, value in cause.unknowns.items()}
    everything = {**graph.defaults, **values, **context, **unknowns}
    quantities = {name: of_parameter(name) for name in (*model.parameters, *model.context)}
    quantities |= {name: of_signal(name) for name in (*model.inputs, *graph.outputs)}
    quantities |= {name: quantity for effect in effects for name, quantity in effect.unknowns.items()}
    return Machine(model, effects, graph, everything, quantities, assumed, taken, words, driven)


def accepted(model: Model, causes: Iterable[Cause]) -> tuple[tuple[Cause, ...], tuple[str, ...]]:
    """The causes that belong to the car and that the model offers, and what to say of the others.

    A sensor's fault, a wind or a slope is part of the test day, not of the car: the published parameters have been
    freed of it already. Those taken in come in the order of the catalogue, in which effects are applied everywhere.
    """
    known = {effect.name: effect for effect in catalogue()}
    offers = {effect.name for effect in applicable(model, catalogue())}
    taken: list[Cause] = []
    notes: list[str] = []
    for cause in causes:
        effect = known.get(cause.effect)
        if effect is None:
            notes.append(f"left out {cause.effect}: this version knows no such cause")
        elif effect.sensor:
            notes.append(f"left out {cause.effect}: a sensor's fault, not the car's")
        elif not effect.lasts:
            notes.append(f"left out {cause.effect}: it stays with the day of the test")
        elif cause.effect not in offers:
            notes.append(f"left out {cause.effect}: the full vehicle has no element for it ({', '.join(effect.on)})")
        elif strange := [name for name in cause.unknowns if name not in effect.unknowns]:
            notes.append(f"left out {cause.effect}: it has no unknown {', '.join(strange)}")
        else:
            taken.append(cause)
            sizes = ", ".join(
                f"{name} = {value:.4g} {effect.unknowns[name].unit}".rstrip() for name, value in cause.unknowns.items()
            )
            notes.append(f"taken in {cause.effect}: {sizes}")
    order = list(known)
    return tuple(sorted(taken, key=lambda cause: order.index(cause.effect))), tuple(notes)


def _doubt(why: str | None) -> str:
    return f" (assumed: {why})" if why else ""
