"""Parts of a model: the law of one element with a free smooth addition over one of its coordinates.

The addition is a sum of cosines along the coordinate. The coordinate is stretched near zero and compressed far from it
where a law may change within a small part of its range (dry friction over the stroke rate).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from vdyn_cli.effects import Effect, effect
from vdyn_cli.engine.maths import copysign, cos, fabs, fmax, fmin, log, sqrt
from vdyn_cli.engine.model_builder import Law, Number, Signals
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.quantity import Quantity

ORDER = 20  # highest order: the cosines resolve waves of a tenth of the span

DERIVATIVE_STEP = 1e-4  # of a parameter, over which a law's derivative is taken

Arguments = Callable[[float, Mapping[str, float]], Mapping[str, float]]


@dataclass(frozen=True)
class Part:
    """One element's law over one coordinate.

    Parameters
    ----------
    element : the law's name in the model. place : the call of the law ("front"); empty: every call.
    coordinate : the signal of the law on which the addition depends.
    span : its range, in ``coordinate_unit``; beyond it the addition is constant.
    size : plausible amplitude of the addition, in ``unit``.
    what, over : words for the law and the coordinate: "the rear dampers' force", "stroke rate".
    scale : of the coordinate, above which it is compressed (asinh x / scale); 0: not compressed.
    anchored : whether the addition is zero at zero of the coordinate.
    law, arguments : the element's law, None for a sensor, and (coordinate, values of unknowns) -> its further signals.
        Changes of the unknowns can absorb part of the addition, so only the sum of law and addition is determined.
    own : the unknowns that ``arguments`` reads; the law is nearly linear in them.
    called : name of the part where it represents more than one law; empty: the element's name.
    related : further laws whose effects belong to this part.
    reads : computes the coordinate from the law's signals, where it is not one of them.
    factor : a signal that multiplies the addition ("heading": it changes sign with the direction of driving).
    sensor : whether the addition is the error of a reading.
    inseparable : names of parts that these logs cannot separate from this one.
    order : highest order of the cosines; lower where the data have too few points for narrow shapes.
    resembles : what else makes such a curve, and how to tell: a sentence, or empty.
    odd : whether the element is alike in both directions, so that of equal formulas an odd one is its law.
    """

    element: str
    place: str
    coordinate: str
    span: tuple[float, float]
    size: float
    unit: str
    coordinate_unit: str
    what: str
    over: str
    scale: float = 0.0
    anchored: bool = True
    law: Law | None = None
    arguments: Arguments = lambda x, values: {}
    own: tuple[str, ...] = ()
    called: str = ""
    related: tuple[str, ...] = ()
    reads: Callable[[Signals], Number] | None = None
    factor: str = ""
    sensor: bool = False
    inseparable: tuple[str, ...] = ()
    order: int = ORDER
    odd: bool = False
    resembles: str = ""

    @property
    def name(self) -> str:
        """The element with its place, as in the JSON: ``damper_rear``."""
        return f"{self.group}_{self.place}" if self.place else self.group

    @property
    def group(self) -> str:
        """The name without the place."""
        return self.called or self.element

    @cached_property
    def orders(self) -> Array:
        """Orders of the cosines; an addition that is zero at zero needs no constant."""
        return np.arange(1 if self.anchored else 0, self.order + 1, dtype=float)

    @property
    def unknowns(self) -> tuple[str, ...]:
        """Names of the coefficients."""
        return tuple(f"free_{self.name}_{self.coordinate}_{int(i)}" for i in self.orders)

    def signals(self, x: float, values: Mapping[str, float]) -> Signals:
        """The law's signals at one value of the coordinate."""
        return Signals(**{"place": f"_{self.place}", "share": 1.0, **self.arguments(x, values), self.coordinate: x})

    def baseline(self, x: Array, values: Mapping[str, float]) -> Array:
        """The law without addition (points,); zero for a sensor."""
        law = self.law
        if law is None:
            return np.zeros(len(x))
        return np.array([float(law(self.signals(float(one), values))) for one in x])

    def slopes(self, x: Array, values: Mapping[str, float]) -> Array:
        """Derivatives (points, own) of the law without addition by its own unknowns, by central differences."""
        columns = []
        for n in (name for name in self.own if name in values):
            step = DERIVATIVE_STEP * max(abs(values[n]), 1e-3)
            ahead, behind = (self.baseline(x, {**values, n: values[n] + d}) for d in (step, -step))
            columns.append((ahead - behind) / (2 * step))
        return np.array(columns).reshape(len(columns), len(x)).T

    def basis(self, x: Array) -> Array:
        """The cosines (points, coefficients) at values (points,) of the coordinate."""
        return np.array([[float(v) for v in self.cosines(float(one))] for one in np.atleast_1d(x)])

    def points(self, count: int) -> Array:
        """Values of the coordinate (count,), equally spaced after the compression."""
        low, high = self._compressed(self.span[0]), self._compressed(self.span[1])
        u = np.linspace(float(low), float(high), count)
        x = self.scale * np.sinh(u) if self.scale else u
        return np.clip(x, *self.span)

    @cached_property
    def effect(self) -> Effect:
        """The free addition as an effect of the model."""
        names, over = self.unknowns, self.coordinate
        many = tuple(
            Quantity(n, self.unit, f"cosine {int(i)} of a free addition over {over}", "", -self.size, self.size)
            for n, i in zip(names, self.orders, strict=True)
        )

        def law(element: Law, s: Signals, q: Signals) -> Number:
            """An addition of any smooth shape over one signal."""
            if not matches(self.place, s.place):
                return element(s)
            total: Number = 0.0
            x = getattr(s, self.coordinate) if self.reads is None else self.reads(s)
            for n, wave in zip(names, self.cosines(x), strict=True):
                total = total + getattr(q, n) * wave
            factor = getattr(s, self.factor) if self.factor else 1.0
            return element(s) + factor * s.__dict__.get("share", 1.0) * total

        law.__name__ = f"free_{self.name}_{self.coordinate}"
        return effect(on=self.element, unknowns=many, reference="smooth, no physics assumed", label=self.what)(law)

    def concerns(self, one: Effect) -> bool:
        """Whether an effect corrects the part's law, or one of those that the part represents."""
        return bool({self.element, *self.related} & set(one.on))

    def cosines(self, x: Any) -> list[Any]:
        """The cosines cos(i pi u) at a value or symbol of the coordinate, in the order of ``orders``.

        u, 0 to 1, is the position in the span after the compression; if ``anchored``, less their values at zero.
        """
        first = self._wave(x)
        zero = float(self._wave(0.0)) if self.anchored else 0.0
        waves, at_zero = [1.0, first], [1.0, zero]
        for _ in range(self.order - 1):  # cos((i + 1) t) = 2 cos(t) cos(i t) - cos((i - 1) t)
            waves.append(2.0 * first * waves[-1] - waves[-2])
            at_zero.append(2.0 * zero * at_zero[-1] - at_zero[-2])
        if self.anchored:
            return [w - z for w, z in zip(waves[1:], at_zero[1:], strict=True)]
        return list(waves)

    def _wave(self, x: Any) -> Any:
        low, high = float(self._compressed(self.span[0])), float(self._compressed(self.span[1]))
        inside = fmin(fmax(x, self.span[0]), self.span[1])
        return cos((self._compressed(inside) - low) * (np.pi / (high - low)))

    def _compressed(self, x: Any) -> Any:
        if not self.scale:
            return x
        ratio = x / self.scale
        return copysign(log(fabs(ratio) + sqrt(ratio * ratio + 1.0)), ratio)


_CORNERS = {"fl": ("front", "left"), "fr": ("front", "right"), "rl": ("rear", "left"), "rr": ("rear", "right")}


def addition(s: Signals) -> Number:
    """A law that is zero without its addition."""
    return 0.0


def sensor_part(element: str, span: tuple[float, float], size: float, unit: str, what: str, place: str = "") -> Part:
    """The error of a reading as a part over its value, both in ``unit``; the arguments are those of ``Part``."""
    return Part(element, place, "value", span, size, unit, unit, what, "value", anchored=False, sensor=True)


def matches(place: str, at: str) -> bool:
    """Whether a law's call at ``at`` ("_fl") belongs to the place ("front"); an empty place matches every call."""
    words = [w for token in at.split("_") for w in _CORNERS.get(token, (token,))]
    return not place or place in words
