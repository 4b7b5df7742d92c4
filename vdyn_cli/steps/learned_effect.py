"""Learned laws as effects, built from their definitions."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.maths import exp, fabs, fmax, sin, sqrt, tanh
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.law_definition import CurveDefinition, LawDefinition
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.quantity import Quantity
from vdyn_cli.steps.free_part import Part, matches

SHARP = 1e-3  # share of the span: width over which a step or a sign changes


@dataclass(frozen=True)
class LawForm:
    """A short formula of one coordinate x.

    Parameters
    ----------
    coefficients : names; the first is the amplitude, in which the formula is linear, then the shape parameters.
    units : of each: "value", "value/x", "x" or "".
    text : the formula.
    law : (x, shapes, definition) -> the addition for an amplitude of one.
    odd : whether it changes only its sign with that of x.
    """

    coefficients: tuple[str, ...]
    units: tuple[str, ...]
    text: str
    law: Callable[[Any, Sequence[Any], CurveDefinition], Any]
    odd: bool = True


def _sense(x: Any, d: CurveDefinition) -> Any:
    width = SHARP * (d.span[1] - d.span[0]) if not d.scale else d.scale * SHARP
    return x / sqrt(x * x + width * width)


def _power(x: Any, exponent: Any, d: CurveDefinition) -> Any:
    """|x / reference|^exponent, with a finite slope at zero."""
    ratio = x / d.reference
    return (ratio * ratio + SHARP**2) ** (exponent / 2.0) - SHARP**exponent


def _bell(x: Any, center: Any, width: Any) -> Any:
    return exp(-(((x - center) / width) ** 2))


LAW_FORMS: Mapping[str, LawForm] = {
    "line": LawForm(("slope",), ("value/x",), "slope * x", lambda x, s, d: x),
    "step": LawForm(("amplitude",), ("value",), "amplitude * sign(x)", lambda x, s, d: _sense(x, d)),
    "saturation": LawForm(
        ("amplitude", "width"), ("value", "x"), "amplitude * tanh(x / width)", lambda x, s, d: tanh(x / s[0])
    ),
    "power": LawForm(
        ("amplitude", "exponent"), ("value", ""), "amplitude * sign(x) * |x / reference|^exponent",
        lambda x, s, d: _sense(x, d) * _power(x, s[0], d),
    ),
    "even_power": LawForm(
        ("amplitude", "exponent"), ("value", ""), "amplitude * |x / reference|^exponent",
        lambda x, s, d: _power(x, s[0], d), odd=False,
    ),
    "knee": LawForm(
        ("slope", "onset"), ("value/x", "x"), "slope * sign(x) * max(|x| - onset, 0)",
        lambda x, s, d: _sense(x, d) * fmax(fabs(x) - s[0], 0.0),
    ),
    "hinge_up": LawForm(
        ("slope", "onset"), ("value/x", "x"), "slope * max(x - onset, 0)", lambda x, s, d: fmax(x - s[0], 0.0),
        odd=False,
    ),
    "hinge_down": LawForm(
        ("slope", "onset"), ("value/x", "x"), "slope * min(x - onset, 0)", lambda x, s, d: -fmax(s[0] - x, 0.0),
        odd=False,
    ),
    "bump": LawForm(
        ("amplitude", "center", "width"), ("value", "x", "x"), "amplitude * exp(-((x - center) / width)^2)",
        lambda x, s, d: _bell(x, s[0], s[1]) - (_bell(0.0, s[0], s[1]) if d.anchored else 0.0),
        odd=False,
    ),
    "periodic": LawForm(
        ("amplitude", "length", "shift"), ("value", "x", "x"), "amplitude * sin(2 pi (x - shift) / length)",
        lambda x, s, d: sin(2 * np.pi * (x - s[1]) / s[0]) - (sin(-2 * np.pi * s[1] / s[0]) if d.anchored else 0.0),
        odd=False,
    ),
}  # fmt: skip


def learned_effect(name: str, law: LawDefinition, starts: Mapping[str, tuple[float, float, float]]) -> Effect:
    """The effect of a learned law: a sum of curves, each over one signal, added to the law of an element.

    Parameters
    ----------
    name : of the effect. law : its element, curves and label.
    starts : (value, lower, upper) of each unknown, SI; values of shape parameters become nominal.
    """
    quantities, nominal = [], {}
    for curve in law.curves:
        for k, unknown in enumerate(curve.unknowns):
            value, lower, upper = starts[unknown]
            quantities.append(Quantity(unknown, unit_of(curve, k), meaning_of(curve, k), "", lower, upper))
            if curve.form != "table" and k:
                nominal[unknown] = value
    additions = [(curve, _addition(law.element, curve)) for curve in law.curves]

    def correction(element: Law, s: Signals, q: Signals) -> Number:
        """An addition to the law over one of its signals, learned from data."""
        total = element(s)
        for curve, addition in additions:
            if matches(curve.place, s.place):
                factor = getattr(s, curve.factor) if curve.factor else 1.0
                values = [getattr(q, n) for n in curve.unknowns]
                total = total + factor * s.__dict__.get("share", 1.0) * addition(getattr(s, curve.coordinate), values)
        return total

    correction.__name__ = name
    made = effect(
        on=law.element,
        unknowns=tuple(quantities),
        reference="learned from the logs, no physics assumed",
        nominal=nominal,
        label=law.label,
        confirm=f"Cover the range of {law.curves[0].coordinate.replace('_', ' ')} again from another starting value.",
        tags=set(law.tags),
    )
    return made(correction)


def meaning_of(curve: CurveDefinition, k: int) -> str:
    """The meaning of the k-th unknown of a curve."""
    if curve.form == "table":
        return f"size of shape {k + 1} of a learned law over {curve.coordinate}"
    return f"{LAW_FORMS[curve.form].coefficients[k]} of a learned law over {curve.coordinate}"


def unit_of(curve: CurveDefinition, k: int) -> str:
    """The unit of the k-th unknown of a curve."""
    if curve.form == "table":
        return curve.unit
    below = curve.coordinate_unit
    slope = f"{curve.unit}/({below})" if set(below) & set("/ ") else f"{curve.unit}/{below}" if below else curve.unit
    kinds = {"value": curve.unit, "x": curve.coordinate_unit, "value/x": slope, "": ""}
    return kinds[LAW_FORMS[curve.form].units[k]]


def _addition(element: str, curve: CurveDefinition) -> Callable[[Any, Sequence[Any]], Any]:
    if curve.form != "table":
        form = LAW_FORMS[curve.form]
        return lambda x, values: values[0] * form.law(x, values[1:], curve)
    basis = np.array(curve.basis)
    order = len(basis) if curve.anchored else len(basis) - 1  # below that of most parts where the data are few points
    part = Part(
        element, curve.place, curve.coordinate, curve.span, 1.0, curve.unit, curve.coordinate_unit, "", "",
        curve.scale, curve.anchored, order=order,
    )  # fmt: skip

    def table(x: Any, values: Sequence[Any]) -> Any:
        # The weights of the cosines do not change in time, so that a simulation computes them once.
        weights = [sum(float(b) * value for b, value in zip(row, values, strict=True)) for row in basis]
        return sum((weight * wave for weight, wave in zip(weights, part.cosines(x), strict=True)), 0.0)

    return table


def learned_effects(parameters: Parameters) -> tuple[Effect, ...]:
    """The effects of the learned laws that belong to the vehicle, at the values estimated by earlier steps.

    Each unknown may move by ten times its value or its standard deviation, whichever is larger.

    Parameters
    ----------
    parameters : with extensions and definitions of learned laws.
    """
    made = []
    for name, law in parameters.laws.items():
        known = parameters.extensions.get(name, {})
        names = [n for c in law.curves for n in c.unknowns]
        if all(n in known for n in names):
            spans = {n: (known[n].value, *_wide(known[n].value, known[n].std)) for n in names}
            made.append(learned_effect(name, law, spans))
    return tuple(made)


def _wide(value: float, std: float) -> tuple[float, float]:
    """A range about the value: ten times its magnitude or its standard deviation to either side."""
    room = 10.0 * max(abs(value), std, 1e-12)
    return value - room, value + room
