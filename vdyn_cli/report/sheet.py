"""A drawing surface in page pixels, written as one compact SVG element."""

from __future__ import annotations

import re
from base64 import b64encode
from collections.abc import Collection
from dataclasses import dataclass, field
from html import escape
from typing import Literal

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.report import typography

Anchor = Literal["start", "middle", "end"]

INK = "#1b1b1b"
FONT = 13.0  # px, at the figures' natural size
STRAIGHT = 0.05  # px, distance from a straight line up to which a point of a path is omitted
FARTHEST = 1e4  # px, beyond which a point is moved nearer: only the part within the axes is visible
PASSES = 4  # over a path to omit points, each of which can halve their number


@dataclass(frozen=True)
class PlotArea:
    """Position and size of axes on the sheet, px from its upper left corner."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True)
class Pen:
    """The look of a line: color, width, px, lengths of dashes and gaps as multiples of the width, shape of its ends."""

    color: str
    width: float = 1.8
    dashes: tuple[float, ...] = ()
    ends: Literal["butt", "square", "round"] = "square"

    @property
    def attributes(self) -> str:
        """The attributes of the SVG path."""
        drawn = f'fill="none" stroke="{self.color}" stroke-width="{self.width:g}"'
        if self.dashes:
            return f'{drawn} stroke-dasharray="{" ".join(f"{d * self.width:g}" for d in self.dashes)}"'
        return drawn if self.ends == "butt" else f'{drawn} stroke-linecap="{self.ends}"'


@dataclass(eq=False)
class Axes:
    """A part of the sheet with scales in data units, linear and without margins; what lies outside is not visible.

    Parameters
    ----------
    x, y : values at the left and right, and at the lower and upper end.
    """

    page: Sheet
    area: PlotArea
    x: tuple[float, float] = (0.0, 1.0)
    y: tuple[float, float] = (0.0, 1.0)
    drawn: list[tuple[float, str]] = field(default_factory=list)

    def px(self, x: Array, y: Array) -> tuple[Array, Array]:
        """Positions of points in px from the upper left corner of the sheet."""
        a, (x0, x1), (y0, y1) = self.area, self.x, self.y
        with np.errstate(all="ignore"):
            return a.left + (x - x0) / ((x1 - x0) or 1.0) * a.width, a.top + (y1 - y) / ((y1 - y0) or 1.0) * a.height

    def line(self, x: Array, y: Array, pen: Pen, order: float) -> None:
        """Draw a line through points (n,); NaN interrupts it. ``order``: what has a larger number is in front."""
        self.drawn.append((order, f'<path d="{path(*self.px(x, y))}" {pen.attributes}/>'))

    def dots(self, x: Array, y: Array, color: str, size: float, order: float) -> None:
        """Draw dots of ``size`` px as strokes of zero length, a tenth of the size of circles in the SVG."""
        known = np.isfinite(x) & np.isfinite(y)
        places = _places(*self.px(x[known], y[known]))
        drawn = "".join(f"M{_pair(one)}h0" for one in places)
        self.drawn.append((order, f'<path d="{drawn}" {Pen(color, size, ends="round").attributes}/>'))

    def segments(self, x: tuple[Array, Array], y: tuple[Array, Array], pen: Pen, order: float) -> None:
        """Draw straight lines, each from the first to the second point."""
        known = np.isfinite(x[0]) & np.isfinite(x[1]) & np.isfinite(y[0]) & np.isfinite(y[1])
        begin, end = (_places(*self.px(x[k][known], y[k][known])) for k in (0, 1))
        drawn = "".join(f"M{_pair(a)}L{_pair(b)}" for a, b in zip(begin, end, strict=True))
        self.drawn.append((order, f'<path d="{drawn}" {pen.attributes}/>'))

    def fill(self, x: Array, y: Array, y2: Array, color: str, alpha: float, order: float) -> None:
        """Fill the region between two lines (n,) over x; NaN interrupts it."""
        px, upper = self.px(x, y)
        _, lower = self.px(x, y2)
        pieces = [
            path(np.r_[px[s], px[s][::-1]], np.r_[upper[s], lower[s][::-1]]) + "z"
            for s in _pieces(np.isfinite(px) & np.isfinite(upper) & np.isfinite(lower))
        ]
        self.drawn.append((order, f'<path d="{"".join(pieces)}" {_filled(color, alpha)}/>'))

    def boxes(self, ends: Array, color: str, alpha: float = 1.0, order: float = 1.0) -> None:
        """Fill rectangles without blurred edges, so that they can touch.

        Parameters
        ----------
        ends : (n, 4), of each its first and last x and its first and last y.
        """
        known = ends[np.isfinite(ends).all(axis=1)]
        first, last = (_places(*self.px(known[:, k], known[:, 2 + k])) for k in (0, 1))
        drawn = "".join(f"M{_pair(a)}H{b[0]:.5g}V{b[1]:.5g}H{a[0]:.5g}z" for a, b in zip(first, last, strict=True))
        self.drawn.append((order, f'<path d="{drawn}" {_filled(color, alpha)} shape-rendering="crispEdges"/>'))

    def spans(self, left: float, right: float, color: str, alpha: float = 1.0, order: float = 1.0) -> None:
        """Fill the range of x from ``left`` to ``right`` over the whole height."""
        self.boxes(np.array([[left, right, *self.y]]), color, alpha, order)

    def image(self, png: bytes, order: float) -> None:
        """Draw a PNG over the whole axes."""
        a = self.area
        place = f'x="{a.left:.5g}" y="{a.top:.5g}" width="{a.width:.5g}" height="{a.height:.5g}"'
        data = b64encode(png).decode("ascii")
        self.drawn.append((order, f'<image {place} preserveAspectRatio="none" href="data:image/png;base64,{data}"/>'))


class Sheet:
    """An empty sheet of width by height, px."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height
        self._axes: list[Axes] = []
        self._drawn: list[tuple[float, str]] = []

    def axes(self, area: PlotArea) -> Axes:
        """Axes in front of what has a negative order and behind the rest."""
        self._axes.append(Axes(self, area))
        return self._axes[-1]

    def lines(self, ends: Collection[tuple[tuple[float, float], tuple[float, float]]], pen: Pen, order: float) -> None:
        """Draw straight lines between pairs of points (x, y), px from the upper left corner, as one path."""
        if ends:
            drawn = "".join(f"M{_pair(a)}L{_pair(b)}" for a, b in ends)
            self._drawn.append((order, f'<path d="{drawn}" {pen.attributes}/>'))

    def patch(self, area: PlotArea, color: str, alpha: float) -> None:
        """Fill a rectangle."""
        place = f'x="{area.left:.5g}" y="{area.top:.5g}" width="{area.width:.5g}" height="{area.height:.5g}"'
        self._drawn.append((1.0, f"<rect {place} {_filled(color, alpha)}/>"))

    def text(
        self, x: float, y: float, text: str, size: float = FONT, color: str = INK, anchor: Anchor = "start"
    ) -> None:
        """Draw text with its baseline at px (x, y) from the upper left corner."""
        look = f' font-size="{size:g}"' * (size != FONT) + f' fill="{color}"' * (color != INK)
        look += f' text-anchor="{anchor}"' * (anchor != "start")
        self._drawn.append((3.0, f'<text x="{x:.5g}" y="{y:.5g}"{look}>{escape(typography.clean(text))}</text>'))

    def svg(self, label: str, name: str) -> str:
        """The sheet as an SVG element for a page.

        Parameters
        ----------
        label : text for screen readers. name : prefix of the ids, unique on the page.
        """
        prefix = re.sub(r"[^A-Za-z0-9]+", "-", name)
        drawn = list(self._drawn)
        for number, axes in enumerate(self._axes):
            a, key = axes.area, f"{prefix}-{number}"
            if axes.drawn:
                box = f'x="{a.left:.5g}" y="{a.top:.5g}" width="{a.width:.5g}" height="{a.height:.5g}"'
                content = "".join(text for _, text in sorted(axes.drawn, key=lambda one: one[0]))
                clip = f'<clipPath id="{key}"><rect {box}/></clipPath>'
                drawn.append((0.0, f'{clip}<g clip-path="url(#{key})">{content}</g>'))
        body = "".join(text for _, text in sorted(drawn, key=lambda one: one[0]))
        return (
            f'<svg class="plot" viewBox="0 0 {self.width:.0f} {self.height:.0f}" style="max-width:{self.width:.0f}px" '
            f'font-size="{FONT:g}" fill="{INK}" role="img" aria-label="{escape(typography.clean(label))}">{body}</svg>'
        )


def path(x: Array, y: Array) -> str:
    """The path of an SVG through points (n,), px: NaN interrupts it, a lone point becomes a dot.

    Points that lie on a straight line between their neighbors are omitted.
    """
    pieces = []
    for s in _pieces(np.isfinite(x) & np.isfinite(y)):
        places = _places(*_without_straight(x[s], y[s]))
        pieces.append("M" + "L".join(map(_pair, places)) + "h0" * (len(places) == 1))
    return "".join(pieces)


def _pieces(known: np.ndarray[tuple[int], np.dtype[np.bool_]]) -> list[slice]:
    """The ranges of samples in which all are known."""
    edges = np.flatnonzero(np.diff(np.r_[False, known, False]))
    return [slice(int(a), int(b)) for a, b in zip(edges[::2], edges[1::2], strict=True)]


def _places(x: Array, y: Array) -> list[tuple[float, float]]:
    """The points to a tenth of a px."""
    xs, ys = (np.round(np.clip(v, -FARTHEST, FARTHEST), 1) + 0.0 for v in (x, y))  # -0.0 becomes 0.0
    return list(zip(xs.tolist(), ys.tolist(), strict=True))


def _pair(point: tuple[float, float]) -> str:
    return f"{point[0]:.5g} {point[1]:.5g}"


def _without_straight(x: Array, y: Array) -> tuple[Array, Array]:
    """The points (n,) without those that are within ``STRAIGHT`` of the line between their neighbors."""
    x, y = (np.clip(v, -FARTHEST, FARTHEST) for v in (x, y))
    for number in range(2 * PASSES):
        middle = np.arange(1 + number % 2, x.size - 1, 2)
        ax, ay = x[middle] - x[middle - 1], y[middle] - y[middle - 1]
        bx, by = x[middle + 1] - x[middle - 1], y[middle + 1] - y[middle - 1]
        length = np.hypot(bx, by)
        straight = (np.abs(ax * by - ay * bx) <= STRAIGHT * length) & (ax * bx + ay * by >= 0.0)
        straight &= np.hypot(ax, ay) <= length + STRAIGHT
        keep = np.ones(x.size, dtype=bool)
        keep[middle[straight]] = False
        x, y = x[keep], y[keep]
    return x, y


def _filled(color: str, alpha: float) -> str:
    return f'fill="{color}"' + f' opacity="{alpha:g}"' * (alpha != 1.0)
