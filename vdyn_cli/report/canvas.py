"""Palette, scales and legends of the figures, which are drawn in page pixels."""

from __future__ import annotations

import math
from collections.abc import Collection, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from vdyn_cli.report import typography
from vdyn_cli.report.sheet import FONT, INK, Axes, Pen, PlotArea, Sheet

# The palette of Okabe and Ito, which color-blind readers can distinguish; line styles differ for black and white.
GRAY, PALE = "#5f5f5f", "#b4b4b4"
BLUE, VERMILLION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY = "#E69F00", "#56B4E9"
DARK_GREEN = "#00553e"
GRID, HELD_OUT, CLOUD = "#e3e3e3", "#fdf3c8", "#8d8d8d"

_TICK = 4.0  # px
_CHARACTER = 0.5 * FONT  # mean advance of the page's sans serif
_THIN = Pen(INK, 0.8, ends="butt")


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
    def pen(self) -> Pen:
        """The look of its line; dashes have straight ends, so that the gaps keep their length."""
        return Pen(self.color, self.width, self.dashes, "butt" if self.dashes else "square")


def add_axes(page: Sheet, area: PlotArea, lines: Collection[str] = ("left", "bottom")) -> Axes:
    """Axes without a scale; ``scale_axis`` adds one.

    Parameters
    ----------
    lines : sides of the axes with a thin line: left, bottom.
    """
    corner = (area.left, area.top + area.height)
    ends = {"left": (area.left, area.top), "bottom": (area.left + area.width, corner[1])}
    page.lines([(corner, ends[side]) for side in ends if side in lines], _THIN, 2.5)
    return page.axes(area)


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


def _round_numbers(low: float, high: float, most: int) -> list[float]:
    """Multiples of 1, 2, 2.5 or 5 times a power of ten: ``most`` intervals or fewer, but two numbers where possible."""
    span = high - low
    if not 0.0 < span < math.inf:
        return [low] if math.isfinite(low) else []
    tens = 10.0 ** math.floor(math.log10(span / most))
    steps = [factor * tens for factor in (0.1, 0.2, 0.25, 0.5, 1.0, 2.0, 2.5, 5.0, 10.0)]
    wide = next(k for k, step in enumerate(steps) if step >= span / most * (1.0 - 1e-9))
    slack = 1e-9 * span
    places: list[float] = []
    for step in reversed(steps[: wide + 1]):
        first, last = math.ceil((low - slack) / step), math.floor((high + slack) / step)
        places = [k * step for k in range(first, last + 1)]
        if len(places) > 1:
            break
    return places


def tick_text(value: float, step: float, grouped: bool) -> str:
    """The text of a tick, with the decimals that the spacing ``step`` needs; ``grouped`` separates thousands."""
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


def scale_axis(
    axes: Axes, which: Literal["x", "y"], room: float, apart: float, grid: bool = False, *, right: bool = False
) -> None:
    """Draw round ticks on an axis whose limits are set.

    Parameters
    ----------
    which : x or y. room : length of the axis, px. apart : smallest distance of two ticks, px.
    grid : whether to draw grid lines. right : the scale of y is on the right.
    """
    low, high = sorted(axes.x if which == "x" else axes.y)
    places, texts = ticks(low, high, room, apart)
    draw_ticks(axes, which, places, texts, grid, right=right)


def draw_ticks(
    axes: Axes,
    which: Literal["x", "y"],
    places: Sequence[float],
    texts: Sequence[str],
    grid: bool = False,
    *,
    right: bool = False,
) -> None:
    """Draw ticks with their labels below or beside axes whose limits are set.

    Parameters
    ----------
    places : of the ticks, data units. texts : their labels. grid : whether to draw a line across the axes at each.
    right : as in ``scale_axis``.
    """
    page, a = axes.page, axes.area
    bottom, stop = a.top + a.height, a.left + a.width
    (start, end), (first, last) = (axes.x, (a.left, stop)) if which == "x" else (axes.y, (bottom, a.top))
    at = [first + (place - start) / ((end - start) or 1.0) * (last - first) for place in places]
    if which == "x":
        marks = [((x, bottom), (x, bottom + _TICK)) for x in at]
        across = [((x, bottom), (x, a.top)) for x in at]
    else:
        edge, way = (stop, 1.0) if right else (a.left, -1.0)
        marks = [((edge, y), (edge + way * _TICK, y)) for y in at]
        across = [((a.left, y), (stop, y)) for y in at]
    page.lines(marks, _THIN, 2.5)
    if grid:
        page.lines(across, Pen(GRID, 0.8, ends="butt"), -1.0)
    for px, text in zip(at, texts, strict=True):
        if text and which == "x":
            page.text(px, bottom + _TICK + 4 + FONT * 0.78, text, anchor="middle")
        elif text:
            beside = edge + way * (_TICK + 4)
            page.text(beside, px + FONT * 0.36, text, anchor="start" if right else "end")


def legend_rows(keys: Sequence[LegendEntry], width: float) -> list[list[tuple[float, LegendEntry]]]:
    """The entries of a legend in rows of a given width, px, each with its distance from the left, px."""
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
    """Draw the rows of a legend, 20 px apart.

    Parameters
    ----------
    rows : from ``legend_rows``. left, top : upper left corner of the legend, px.
    """
    for number, row in enumerate(rows):
        middle = top + 20 * number + 10
        for at, key in row:
            x = left + at
            if key.look == "patch":
                page.patch(PlotArea(x, middle - 5, 26, 10), key.color, key.alpha)
            elif key.look == "points":
                page.lines([((x + 13, middle), (x + 13, middle))], Pen(key.color, 6, ends="round"), 2.0)
            else:
                page.lines([((x, middle), (x + 26, middle))], key.pen, 2.0)
            page.text(x + 33, top + 20 * number + 14.5, key.label)


def label_room(text: str, size: float = FONT) -> float:
    """Approximate width, px, of a text with the font size ``size``, px."""
    return len(text) * _CHARACTER * size / FONT
