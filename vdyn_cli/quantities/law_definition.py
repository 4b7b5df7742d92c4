"""A learned law as data: what a result's JSON holds of it, and what other steps and exports rebuild it from."""

from __future__ import annotations

from typing import Literal

from vdyn_cli.quantities.diagnosis import Record

Form = Literal[
    "table", "step", "saturation", "line", "power", "even_power", "bump", "knee", "hinge_up", "hinge_down", "periodic"
]


class CurveDefinition(Record):
    """The addition to one element's law at one place, over one signal of the law.

    Parameters
    ----------
    place : the call of the law ("front"), or every call where empty. coordinate : the law's signal, in
        ``coordinate_unit``; ``factor`` : a signal that multiplies the addition, or empty.
    span : of the coordinate; beyond, a table is constant. scale : above which the table's cosines are compressed.
    anchored : the addition is zero at zero.
    form : of the addition. unknowns : its coefficients, in the order of the form.
    basis : of a table, one row for each cosine: how its coefficients follow from the unknowns. Empty for formulas.
    reference : of a power, the coordinate at which it has its size.
    """

    place: str
    coordinate: str
    coordinate_unit: str
    unit: str
    factor: str
    span: tuple[float, float]
    scale: float
    anchored: bool
    form: Form
    unknowns: tuple[str, ...]
    basis: tuple[tuple[float, ...], ...] = ()
    reference: float = 1.0


class LawDefinition(Record):
    """A learned law: the element it corrects, in words, and its curves, one for each place."""

    element: str
    label: str
    tags: tuple[str, ...]
    curves: tuple[CurveDefinition, ...]
