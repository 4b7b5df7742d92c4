"""A sheet of axes, lines and texts in px, written as compact SVG: all that the report's figures are made of.

Places are px from the upper left corner. Numbers are written to a tenth of a px; points that a reader could not tell
from a straight line between their neighbors are left out.
"""

from __future__ import annotations

import base64
import re
import struct
import zlib
from collections.abc import Sequence
from dataclasses import dataclass
from html import escape
from typing import TYPE_CHECKING, Literal

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Array = NDArray[np.float64]

FAR = 20_000.0  # px: a place beyond it is drawn there, far outside every sheet
STRAIGHT = 0.06  # px from the line between its neighbors, at which a point is left out
PASSES = 6  # over a line, each of which may leave out every other point: the line stays within a third of a px
TICK, PAD = 4.0, 8.0  # px: length of a tick, and from the axis to its label
UNDER = 17.8  # px from the lower axis to the baseline of its labels
BASE = 4.9  # px from the middle of a text to its baseline

Side = Literal["left", "bottom", "right"]


@dataclass(frozen=True)
class PlotArea:
    """The place of axes on the sheet, px from its upper left corner."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True)
class Stroke:
    """How a line is drawn.

    Parameters
    ----------
    width : px. dashes : lengths of strokes and gaps in widths of the line; empty for a solid line.
    dots : every point is a round dot, without a line between them.
    """

    color: str
    width: float = 1.8
    dashes: tuple[float, ...] = ()
    alpha: float = 1.0
    dots: bool = False

    @property
    def attributes(self) -> str:
        """The attributes of an SVG path."""
        text = f'fill="none" stroke="{self.color}" stroke-width="{number(self.width)}" '
        text += 'stroke-linecap="round"' if self.dots else 'stroke-linejoin="round"'
        if self.dashes:
            text += f' stroke-dasharray="{" ".join(number(self.width * d) for d in self.dashes)}"'
        return text + (f' opacity="{self.alpha:g}"' if self.alpha < 1 else "")


@dataclass(frozen=True)
class Fill:
    """How a shape is filled."""

    color: str
    alpha: float = 1.0

    @property
    def attributes(self) -> str:
        """The attributes of an SVG path."""
        return f'fill="{self.color}"' + (f' opacity="{self.alpha:g}"' if self.alpha < 1 else "")


class Axes:
    """A plot in data coordinates; what lies beyond its limits is not shown.

    Parameters
    ----------
    area : its place. color, size : of axis lines and labels, px.
    """

    def __init__(self, area: PlotArea, color: str, size: float) -> None:
        self.area, self._color, self._size = area, color, size
        self.x_limits, self.y_limits = (0.0, 1.0), (0.0, 1.0)
        self._inside: list[tuple[float, str]] = []
        self._grid: list[str] = []
        self._scales: list[str] = []
        self._lines: set[Side] = {"left", "bottom"}

    def set_limits(self, x: tuple[float, float] | None = None, y: tuple[float, float] | None = None) -> None:
        """Data at the left and right, and at the lower and upper end of the axes; before anything is drawn."""
        self.x_limits, self.y_limits = x or self.x_limits, y or self.y_limits

    def x_px(self, x: Array | float) -> Array:
        """px from the left of the sheet."""
        low, high = self.x_limits
        return np.asarray(self.area.left + (np.asarray(x) - low) / (high - low) * self.area.width)

    def y_px(self, y: Array | float) -> Array:
        """px from the top of the sheet."""
        low, high = self.y_limits
        return np.asarray(self.area.top + (high - np.asarray(y)) / (high - low) * self.area.height)

    def line(self, x: Array, y: Array, stroke: Stroke, order: float) -> None:
        """A line with a gap at every NaN, or a cloud of dots; shapes of a higher order lie above."""
        self._draw(path(self.x_px(x), self.y_px(y), stroke.dots), stroke.attributes, order)

    def band(self, x: Array, low: Array, high: Array, fill: Fill, order: float) -> None:
        """The area between two lines; it ends where one is NaN."""
        known = np.isfinite(x) & np.isfinite(low) & np.isfinite(high)
        ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]])))
        outlines = []
        for a, b in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
            around = np.concatenate([low[a:b], high[a:b][::-1]])
            outlines.append(path(self.x_px(np.concatenate([x[a:b], x[a:b][::-1]])), self.y_px(around)) + "z")
        self._draw("".join(outlines), fill.attributes, order)

    def rectangles(self, x: tuple[Array, Array], y: tuple[Array, Array], fill: Fill, order: float) -> None:
        """Rectangles from x[0] to x[1] and from y[0] to y[1] as one shape."""
        sides = np.stack(np.broadcast_arrays(self.x_px(x[0]), self.x_px(x[1]), self.y_px(y[0]), self.y_px(y[1])), -1)
        rows = [[number(v) for v in row] for row in _within(sides.reshape(-1, 4)).tolist()]
        self._draw("".join(f"M{a} {c}H{b}V{d}H{a}z" for a, b, c, d in rows), fill.attributes, order)

    def picture(self, image: NDArray[np.uint8]) -> None:
        """A picture over the whole area, below everything else."""
        a = self.area
        place = f'x="{number(a.left)}" y="{number(a.top)}" width="{number(a.width)}" height="{number(a.height)}"'
        link = f'href="data:image/png;base64,{base64.b64encode(png(image)).decode("ascii")}"'
        self._inside.append((0.0, f'<image {place} preserveAspectRatio="none" {link}/>'))

    def without(self, *sides: Side) -> None:
        """Leave out axis lines."""
        self._lines -= set(sides)

    def scale(self, side: Side, places: Sequence[float], texts: Sequence[str], grid: str = "") -> None:
        """Ticks and their labels along one side; grid lines in this color, if any."""
        a, bottom, right = self.area, number(self.area.top + self.area.height), self.area.left + self.area.width
        across = side == "bottom"
        pixels = (self.x_px if across else self.y_px)(np.array(places, dtype=np.float64)).tolist()
        edge = right if side == "right" else a.left
        outward = TICK if side == "right" else -TICK
        ticks = [
            f"M{number(p)} {bottom}v{TICK:g}" if across else f"M{number(edge)} {number(p)}h{outward:g}" for p in pixels
        ]
        self._scales.append(f'<path d="{"".join(ticks)}" stroke="{self._color}" stroke-width="0.8"/>' if ticks else "")
        anchor = {"bottom": "middle", "left": "end", "right": "start"}[side]
        for p, text in zip(pixels, texts, strict=True):
            at = (p, a.top + a.height + UNDER) if across else (edge + outward / TICK * PAD, p + BASE)
            self._scales.append(text_element(at, text, self._size, self._color, anchor))
        if grid:
            lines = [
                f"M{number(p)} {number(a.top)}v{number(a.height)}"
                if across
                else f"M{number(a.left)} {number(p)}h{number(a.width)}"
                for p in pixels
            ]
            self._grid.append(f'<path d="{"".join(lines)}" stroke="{grid}" stroke-width="0.8"/>' if lines else "")

    def svg(self, clip: str) -> str:
        """The axes as SVG; ``clip`` is the id of their clip path."""
        a = self.area
        left, top, right, bottom = (number(v) for v in (a.left, a.top, a.left + a.width, a.top + a.height))
        rule = f'<clipPath id="{clip}"><path d="M{left} {top}H{right}V{bottom}H{left}z"/></clipPath>'
        inside = "".join(text for _, text in sorted(self._inside, key=lambda one: one[0]))
        whole = {"left": f"M{left} {top}V{bottom}", "bottom": f"M{left} {bottom}H{right}", "right": ""}
        frame = "".join(whole[side] for side in ("left", "bottom") if side in self._lines)
        lines = f'<path d="{frame}" stroke="{self._color}" stroke-width="0.8"/>' if frame else ""
        pictures = "".join(self._grid) + f'<g clip-path="url(#{clip})">{inside}</g>' + lines + "".join(self._scales)
        return f"<g>{rule}{pictures}</g>"

    def _draw(self, outline: str, attributes: str, order: float) -> None:
        if outline:
            self._inside.append((order, f'<path d="{outline}" {attributes}/>'))


class Sheet:
    """A sheet of width by height, px: axes, and lines and texts above them."""

    def __init__(self, width: float, height: float) -> None:
        self.width, self.height = width, height
        self._axes: list[Axes] = []
        self._above: list[str] = []

    def add(self, axes: Axes) -> Axes:
        """Put axes on the sheet."""
        self._axes.append(axes)
        return axes

    def text(self, element: str) -> None:
        """Put an SVG element above all axes."""
        self._above.append(element)

    def svg(self, label: str, name: str) -> str:
        """The sheet as an SVG element for a page.

        Parameters
        ----------
        label : text for screen readers. name : prefix of the ids, unique on the page.
        """
        prefix = re.sub(r"[^A-Za-z0-9]+", "-", name)
        head = (
            f'<svg class="plot" viewBox="0 0 {self.width:.0f} {self.height:.0f}" style="max-width:{self.width:.0f}px" '
            f'role="img" aria-label="{escape(label)}">'
        )
        axes = "".join(one.svg(f"{prefix}-{k}") for k, one in enumerate(self._axes))
        return head + axes + "".join(self._above) + "</svg>"


def number(value: float) -> str:
    """A number to a tenth, without needless characters."""
    return f"{round(value, 1) + 0.0:g}"


def text_element(at: tuple[float, float], text: str, size: float, color: str, anchor: str = "start") -> str:
    """A text as SVG, its baseline at ``at``, px."""
    aligned = "" if anchor == "start" else f' text-anchor="{anchor}"'
    place = f'x="{number(at[0])}" y="{number(at[1])}"'
    return f'<text {place} fill="{color}"{aligned} style="font-size: {size:g}px">{escape(text)}</text>'


def path(x: Array, y: Array, dots: bool = False) -> str:
    """The commands of a path through points, px, with a gap at every NaN; of dots as strokes of no length."""
    known = np.isfinite(x) & np.isfinite(y)
    if dots:
        return "".join(f"M{a:g} {b:g}h0" for a, b in _rounded(x[known], y[known]))
    ends = np.flatnonzero(np.diff(np.concatenate([[False], known, [False]])))
    parts = []
    for a, b in zip(ends[::2].tolist(), ends[1::2].tolist(), strict=True):
        points = _rounded(*simplified(_within(x[a:b]), _within(y[a:b])))
        parts.append("M" + "L".join([f"{p:g} {q:g}" for p, q in points]) + ("h0" if len(points) == 1 else ""))
    return "".join(parts)


def simplified(x: Array, y: Array) -> tuple[Array, Array]:
    """The line without points that lie on the straight line between their neighbors."""
    for _ in range(PASSES):
        if x.size < 3:
            break
        dx, dy = x[2:] - x[:-2], y[2:] - y[:-2]
        ax, ay = x[1:-1] - x[:-2], y[1:-1] - y[:-2]
        long = dx * dx + dy * dy
        along, off = ax * dx + ay * dy, ax * dy - ay * dx
        between = (along >= 0.0) & (along <= long) & (ax * ax + ay * ay <= long + STRAIGHT**2)
        needless = (off * off <= STRAIGHT**2 * long) & between
        needless[1::2] = False  # each keeps its two neighbors
        if not needless.any():
            break
        keep = np.concatenate([[True], ~needless, [True]])
        x, y = x[keep], y[keep]
    return x, y


def _rounded(x: Array, y: Array) -> list[tuple[float, float]]:
    rounded = np.round(_within(np.stack([x, y], -1)), 1) + 0.0  # -0.0 becomes 0.0
    return [(a, b) for a, b in rounded.tolist()]


def _within(places: Array) -> Array:
    return np.clip(places, -FAR, FAR)


def png(image: NDArray[np.uint8]) -> bytes:
    """A picture (rows, columns), or with 3 or 4 colors, as a PNG file.

    Each row is written as its difference from the row above, which packs well.
    """
    rows = image.reshape(image.shape[0], image.shape[1], -1)
    kind = {1: 0, 2: 4, 3: 2, 4: 6}[rows.shape[2]]
    flat = rows.reshape(rows.shape[0], -1)
    above = np.concatenate([np.zeros_like(flat[:1]), flat[:-1]])
    lines = np.concatenate([np.full((flat.shape[0], 1), 2, dtype=np.uint8), flat - above], axis=1)
    head = struct.pack(">IIBBBBB", rows.shape[1], rows.shape[0], 8, kind, 0, 0, 0)
    chunks = ((b"IHDR", head), (b"IDAT", zlib.compress(lines.tobytes(), 9)), (b"IEND", b""))
    packed = (struct.pack(">I", len(d)) + k + d + struct.pack(">I", zlib.crc32(k + d)) for k, d in chunks)
    return b"\x89PNG\r\n\x1a\n" + b"".join(packed)
