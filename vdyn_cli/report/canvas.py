"""The sheet on which figures are drawn, in page pixels: colors, ticks, legends, texts."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal

from vdyn_cli.report import typography
from vdyn_cli.report.svg_sheet import Axes, Fill, PlotArea, Sheet, Stroke, text_element

# The palette of Okabe and Ito, which color-blind readers can discriminate; line styles do it in black and white.
INK, GRAY, PALE = "#1b1b1b", "#5f5f5f", "#b4b4b4"
BLUE, VERMILLION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY = "#E69F00", "#56B4E9"
DARK_GREEN = "#00553e"
GRID, HELD_OUT, CLOUD = "#e3e3e3", "#fdf3c8", "#8d8d8d"

FONT = 13.0  # px; the page's figures are drawn at their natural size on a laptop
_CHARACTER = 0.5 * FONT  # mean advance of the page's sans serif

_STEPS = (0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 2.5, 5.0, 10.0, 20.0)  # of ticks, in powers of ten


@dataclass(frozen=True)
class LegendEntry:
    """An entry of the legend."""

    label: str
    color: str
    look: Literal["line", "points", "patch"] = "line"
    dashes: tuple[float, ...] = ()
    width: float = 1.8
    alpha: float = 1.0

    @property
    def stroke(self) -> Stroke:
        """How its line is drawn."""
        return Stroke(self.color, self.width, self.dashes)

    @property
    def fill(self) -> Fill:
        """How its shape is filled."""
        return Fill(self.color, self.alpha)


def add_axes(page: Sheet, area: PlotArea) -> Axes:
    """Axes with a thin left and bottom line and no ticks yet."""
    return page.add(Axes(area, INK, FONT))


def text_at(page: Sheet, x: float, y: float, text: str, size: float = FONT, **settings: Any) -> None:
    """Text with its baseline at px (x, y) from the sheet's upper left corner.

    Parameters
    ----------
    settings : ``color``, and ``anchor``: start, middle or end.
    """
    color, anchor = settings.get("color", INK), settings.get("anchor", "start")
    page.text(text_element((x, y), typography.clean(text), size, color, anchor))


def ticks(low: float, high: float, room: float, apart: float = 60.0) -> tuple[list[float], list[str]]:
    """Round numbers between two limits, at least ``apart`` px from each other, and their texts.

    Parameters
    ----------
    low, high : limits in data units. room : length of the axis, px. apart : px.
    """
    places = _round_numbers(low, high, max(int(room // apart), 1))
    step = min((b - a for a, b in pairwise(places)), default=abs(high - low) or 1.0)
    grouped = max(abs(low), abs(high)) >= 10_000
    return places, [tick_text(v, step, grouped) for v in places]


def _round_numbers(low: float, high: float, number: int) -> list[float]:
    """Multiples of the smallest step that makes at most ``number`` intervals; of a smaller one for at least two."""
    span = high - low
    if not span > 0:
        return [low]
    scale = 10.0 ** math.floor(math.log10(span / number))
    slack = 1e-9 * span
    large = next(i for i, step in enumerate(_STEPS) if step * scale >= span / number * (1 - 1e-12))
    places: list[float] = []
    for step in (s * scale for s in reversed(_STEPS[: large + 1])):
        first, last = math.ceil((low - slack) / step), math.floor((high + slack) / step)
        places = [k * step for k in range(first, last + 1)]
        if len(places) >= 2:
            break
    return places


def tick_text(value: float, step: float, grouped: bool = False) -> str:
    """A tick's number with the decimals that its spacing needs, its thousands separated where requested."""
    largest = max(abs(value), step)
    if step < 1e-5 or largest >= 1e7:
        return "0" if abs(value) < 1e-9 * step else typography.significant(value, 3)
    decimals = max(0, -math.floor(math.log10(step) + 1e-9))
    if abs(step * 10**decimals - round(step * 10**decimals)) > 1e-6:
        decimals += 1  # steps of 2.5
    text = typography.fixed(value, decimals)
    whole, point, fraction = text.partition(".")
    digits = whole.lstrip(typography.MINUS)
    if grouped and len(digits) > 3:
        whole = whole[: -len(digits)] + f"{int(digits):,}".replace(",", typography.NARROW)
    return whole + point + fraction


def scale_axis(axes: Axes, which: Literal["x", "y"], room: float, apart: float, grid: bool = False) -> None:
    """Put round ticks on an axis whose limits are set.

    Parameters
    ----------
    room : length of the axis, px. apart : least distance of two ticks, px. grid : whether to draw grid lines.
    """
    low, high = sorted(axes.x_limits if which == "x" else axes.y_limits)
    places, texts = ticks(low, high, room, apart)
    axes.scale("bottom" if which == "x" else "left", places, texts, GRID if grid else "")


def legend_rows(keys: Sequence[LegendEntry], width: float) -> list[list[tuple[float, LegendEntry]]]:
    """The entries of a legend in rows of a given width: each with its px from the left.

    Parameters
    ----------
    width : px.

    Returns
    -------
    For each row its entries, each with its distance from the left, px.
    """
    rows: list[list[tuple[float, LegendEntry]]] = []
    at = math.inf
    for key in keys:
        need = 34 + len(key.label) * _CHARACTER + 22
        if at + need > width + 22:
            rows.append([])
            at = 0.0
        rows[-1].append((at, key))
        at += need
    return rows


def draw_legend(page: Sheet, rows: Sequence[Sequence[tuple[float, LegendEntry]]], left: float, top: float) -> None:
    """Draw a legend's lines, 20 px apart.

    Parameters
    ----------
    rows : from ``legend_rows``. left, top : upper left corner of the legend, px.
    """
    for number, row in enumerate(rows):
        middle = top + 20 * number + 10
        for at, key in row:
            x = left + at
            if key.look == "patch":
                mark, look = f"M{x:g} {middle - 5:g}h26v10h-26z", key.fill.attributes
            elif key.look == "points":
                mark, look = f"M{x + 13:g} {middle:g}h0", Stroke(key.color, 6.0, dots=True).attributes
            else:
                mark, look = f"M{x:g} {middle:g}h26", Stroke(key.color, key.width, key.dashes, key.alpha).attributes
            page.text(f'<path d="{mark}" {look}/>')
            text_at(page, x + 33, middle + 4.5, key.label)


def label_room(text: str, size: float = FONT) -> float:
    """About how many px a text takes."""
    return len(text) * _CHARACTER * size / FONT


def to_svg(page: Sheet, label: str, name: str) -> str:
    """The sheet as an SVG element for a page; the same sheet gives the same text.

    Parameters
    ----------
    label : text for screen readers. name : prefix of the ids, unique on the page.
    """
    return page.svg(typography.clean(label), name)
