"""The vehicle of an export to C: the full model with the accepted effects, and the values of all its constants."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

from vdyn_cli.effects import Effect, catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.c_source import CProgram, c_program
from vdyn_cli.engine.graph import Graph, trace
from vdyn_cli.engine.model import Model
from vdyn_cli.export.parameter_file import AcceptedEffect, ParameterFile, completed
from vdyn_cli.export.quantity_texts import comment, parameter_quantity, signal_quantity, state_quantity
from vdyn_cli.physics.models.vehicle import Driven, vehicle
from vdyn_cli.physics.models.vehicle_axle import Differential
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.learned_effect import learned_effects

LONGEST_STEP = 1e-3  # s, the longest step that resolves half-shafts and wheel hop


@dataclass(frozen=True)
class ExportedVehicle:
    """A model with the values of its constants.

    Parameters
    ----------
    model, effects, graph : the model, its effects, and its traced equations.
    values : of every constant of the graph: parameters, unknowns of the effects and context, SI.
    quantities : unit and meaning of parameters, inputs, outputs.
    assumed : the reason for the value of each parameter that was not given.
    accepted : the included effects with their values.
    effect_notes : included effects, and the reasons for excluding others.
    driven, differential : the driven axle, and the type of its differential.
    """

    model: Model
    effects: tuple[Effect, ...]
    graph: Graph
    values: Mapping[str, float]
    quantities: Mapping[str, Quantity]
    assumed: Mapping[str, str]
    accepted: tuple[AcceptedEffect, ...]
    effect_notes: tuple[str, ...]
    driven: Driven
    differential: Differential

    @property
    def notes(self) -> tuple[str, ...]:
        """Every assumption and every effect, one line each."""
        return (*(f"assumed {name}: {why}" for name, why in self.assumed.items()), *self.effect_notes)

    @property
    def _summary(self) -> str:
        differential = f"{self.differential} differential" + ("s" if self.driven == "both" else "")
        return f"SI units. Driven: {self.driven}, {differential}. Steps of at most {LONGEST_STEP:g} s."

    def program(self, name: str, title: str) -> CProgram:
        """The vehicle as C source with a start speed; a caller's time step must not exceed LONGEST_STEP."""
        comments = {n: comment(state_quantity(n)) for n in self.graph.states}
        comments |= {n: comment(q) + _assumption(self.assumed.get(n)) for n, q in self.quantities.items()}
        lines = (title, self._summary, *self.effect_notes)
        return c_program(
            self.graph, 1, name, start=("speed",), defaults=self.values, comments=comments, title="\n   ".join(lines)
        )


def exported_vehicle(
    parameter_file: ParameterFile, driven: Driven, differential: Differential = "open"
) -> ExportedVehicle:
    """The vehicle of a parameter file, values in SI, with its driven axle and differential.

    Assumes a heading of 0 and, where the file has no temperature, 293.15 K.

    Parameters
    ----------
    driven, differential : as in ``ExportOptions``.

    Raises
    ------
    InputError : parameters are missing and have no default.
    """
    model = vehicle(driven, differential=differential)
    values, assumed = completed(parameter_file, model.parameters, "the full vehicle")
    context = {"heading": 0.0, "temperature": parameter_file.values.get("temperature", 293.15)}
    every = (*catalog(), *learned_effects(parameter_file.parameters))
    included, notes = accepted_effects(model, parameter_file.effects, every)
    known = {effect.name: effect for effect in every}
    effects = tuple(known[one.effect] for one in included)
    graph = trace(model, effects)
    unknowns = {name: value for one in included for name, value in one.unknowns.items()}
    everything = {**graph.defaults, **values, **context, **unknowns}
    quantities = {name: parameter_quantity(name) for name in (*model.parameters, *model.context)}
    quantities |= {name: signal_quantity(name) for name in (*model.inputs, *graph.outputs)}
    quantities |= {name: quantity for effect in effects for name, quantity in effect.unknowns.items()}
    return ExportedVehicle(
        model, effects, graph, everything, quantities, assumed, included, notes, driven, differential
    )


def accepted_effects(
    model: Model, effects: Iterable[AcceptedEffect], every: Sequence[Effect]
) -> tuple[tuple[AcceptedEffect, ...], tuple[str, ...]]:
    """The effects that belong to the vehicle and apply to the model, in the catalog's order; a note for each effect.

    A sensor fault, a wind or a slope belongs to the test day, not to the vehicle, and the published parameters are
    already corrected for it.

    Parameters
    ----------
    every : the catalog followed by learned laws.
    """
    known = {effect.name: effect for effect in every}
    offers = {effect.name for effect in applicable(model, every)}
    included: list[AcceptedEffect] = []
    notes: list[str] = []
    for one in effects:
        effect = known.get(one.effect)
        if effect is None:
            notes.append(f"excluded {one.effect}: not an effect of this version")
        elif effect.sensor:
            notes.append(f"excluded {one.effect}: a sensor fault, not a vehicle property")
        elif not effect.lasts:
            notes.append(f"excluded {one.effect}: it is a property of the test day, not of the vehicle")
        elif one.effect not in offers:
            notes.append(f"excluded {one.effect}: the full vehicle has no element for it ({', '.join(effect.on)})")
        elif strange := [name for name in one.unknowns if name not in effect.unknowns]:
            notes.append(f"excluded {one.effect}: it has no unknown {', '.join(strange)}")
        else:
            included.append(one)
            values = ", ".join(
                f"{name} = {value:.4g} {effect.unknowns[name].unit}".rstrip() for name, value in one.unknowns.items()
            )
            notes.append(f"included {one.effect}: {values}")
    order = list(known)
    return tuple(sorted(included, key=lambda one: order.index(one.effect))), tuple(notes)


def _assumption(why: str | None) -> str:
    return f" (assumed: {why})" if why else ""
