"""A learned law as data: its form in a result's JSON, from which other steps and exports rebuild it."""

from __future__ import annotations

from typing import Literal

from vdyn_cli.quantities.diagnosis import Record

Form = Literal[
    "table", "step", "saturation", "line", "power", "even_power", "bump", "knee", "hinge_up", "hinge_down", "periodic"
]


class CurveDefinition(Record):
    """Addition to one element's law at one place, as a function of one signal of the law.

    Parameters
    ----------
    place : call of the law ("front"); empty: every call. coordinate : name of the law's signal, in
        ``coordinate_unit``. unit : of the addition. factor : signal that multiplies the addition, or empty.
    span : range of the coordinate; outside it a table is constant. scale : coordinate above which the table's cosines
        are compressed.
    anchored : the addition is zero at zero.
    form : of the addition. unknowns : names of its coefficients, in the order of the form.
    basis : of a table, one row per cosine: linear map from the unknowns to its coefficients. Empty for formulas.
    reference : of a power, the coordinate at which the addition equals its coefficient.
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
    """A learned law: the element that it corrects, its label and tags, and one curve for each place."""

    element: str
    label: str
    tags: tuple[str, ...]
    curves: tuple[CurveDefinition, ...]
