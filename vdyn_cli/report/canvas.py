"""Drawing in page pixels with matplotlib, and conversion to compact SVG."""

from __future__ import annotations

import contextlib
import io
import logging
import math
import os
import re
import warnings
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass
from html import escape
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.report import typography

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as MplFigure

# The palette of Okabe and Ito, which color-blind readers can distinguish; line styles differ for black and white.
INK, GRAY, PALE = "#1b1b1b", "#5f5f5f", "#b4b4b4"
BLUE, VERMILLION, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"
ORANGE, SKY = "#E69F00", "#56B4E9"
DARK_GREEN = "#00553e"
GRID, HELD_OUT, CLOUD = "#e3e3e3", "#fdf3c8", "#8d8d8d"

FONT = 13.0  # px, at the figures' natural size
_TICK = 4.0  # px
_CHARACTER = 0.5 * FONT  # mean advance of the page's sans serif

_STYLE: Any = {
    "svg.fonttype": "none",
    "svg.hashsalt": "vdyn",
    "svg.image_inline": True,
    "text.parse_math": False,
    "path.simplify": True,
    "path.simplify_threshold": 0.2,  # px
    "path.snap": False,
    "font.size": FONT,
    "font.family": ["DejaVu Sans"],
    "axes.unicode_minus": True,
    "image.composite_image": False,
}


Point = tuple[float, float]


@dataclass(frozen=True)
class PlotArea:
    """Position and size of axes on the figure, px from its upper left corner."""

    left: float
    top: float
    width: float
    height: float


@dataclass(frozen=True)
class LegendEntry:
    """An entry of the legend."""

    label: str
    color: str
    look: Literal["line", "points", "patch"] = "line"
    dashes: str | tuple[float, tuple[float, ...]] = "-"
    width: float = 1.8
    alpha: float = 1.0


@contextlib.contextmanager
def style() -> Iterator[None]:
    """Context with the drawing settings, so that the user's matplotlib settings have no influence.

    A page enters it once for all its figures, because setting all of matplotlib's settings takes as long as a figure.
    """
    matplotlib = _matplotlib()
    if _is_style(matplotlib):
        yield
        return
    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_STYLE)
        yield


def _is_style(matplotlib: Any) -> bool:
    """Whether matplotlib already has these settings; all others are its defaults, since no file of settings is read."""
    return all(matplotlib.rcParams[name] == value for name, value in _STYLE.items())


def _matplotlib() -> Any:
    """The library, imported in a folder without a ``matplotlibrc``, which it reads from the working directory."""
    logging.getLogger("matplotlib").setLevel(logging.ERROR)  # its warnings concern its cache, not the report
    os.environ["MATPLOTLIBRC"] = os.devnull
    try:
        with contextlib.chdir(Path(__file__).parent):
            import matplotlib
    except OSError as error:
        remedy = "set the environment variable MPLCONFIGDIR to a writable folder"
        found = Finding("matplotlib", "has no writable folder for its cache", str(error)[:80], remedy)
        raise InputError(found) from None
    return matplotlib


def load() -> None:
    """Import everything that a figure needs, and read its font.

    Raises
    ------
    InputError : matplotlib has no writable folder.
    """
    with style():
        page = new_figure(10.0, 10.0)
        text_at(page, 0.0, 10.0, "0")
        to_svg(page, "", "")


def every_stroke() -> Any:
    """Context in which lines keep all their points; a dot is a stroke of zero length and would be simplified away."""
    return _matplotlib().rc_context({"path.simplify": False})


def new_figure(width: float, height: float) -> MplFigure:
    """An empty figure of width by height, px."""
    from matplotlib.figure import Figure as MplFigure

    return MplFigure(figsize=(width / 72, height / 72), dpi=72, facecolor="none")


def add_axes(page: MplFigure, area: PlotArea, lines: Collection[str] = ("left", "bottom")) -> Axes:
    """Axes without a scale; ``scale_axis`` adds one.

    Matplotlib's axis objects take half of the time of a figure, so lines, ticks and labels are drawn on the figure.

    Parameters
    ----------
    lines : sides of the axes with a thin line: left, bottom.
    """
    from vdyn_cli.report.tickless_axes import TicklessAxes

    width, height = page.get_size_inches() * 72
    bottom = height - area.top - area.height
    within = (area.left / width, bottom / height, area.width / width, area.height / height)
    axes = page.add_axes(within, axes_class=TicklessAxes)
    axes.set_axis_off()
    ends = {"left": (area.left, bottom + area.height), "bottom": (area.left + area.width, bottom)}
    _strokes(page, [((area.left, bottom), ends[side]) for side in ends if side in lines], INK, 2.5)
    return axes


def _strokes(page: MplFigure, lines: Sequence[tuple[Point, Point]], color: str, order: float) -> None:
    """Draw thin straight lines as one path; points in px from the lower left corner of the figure."""
    from matplotlib.lines import Line2D

    if lines:
        gap = (math.nan, math.nan)
        xs, ys = zip(*(point for line in lines for point in (*line, gap)), strict=True)
        page.add_artist(Line2D(xs, ys, color=color, lw=0.8, solid_capstyle="butt", transform=None, zorder=order))


def text_at(
    page: MplFigure, x: float, y: float, text: str, size: float = FONT, color: str = INK, **settings: Any
) -> None:
    """Draw text with its baseline at px (x, y) from the figure's upper left corner."""
    width, height = page.get_size_inches() * 72
    page.text(x / width, 1 - y / height, typography.clean(text), size=size, color=color, va="baseline", **settings)


def ticks(low: float, high: float, room: float, apart: float) -> tuple[list[float], list[str]]:
    """Round numbers between two limits, at least ``apart`` px from each other, and their texts.

    Parameters
    ----------
    low, high : limits in data units. room : length of the axis, px. apart : px.
    """
    from matplotlib.ticker import MaxNLocator

    number = max(int(room // apart), 1)
    locator = MaxNLocator(nbins=number, steps=[1, 2, 2.5, 5, 10], min_n_ticks=2)
    slack = 1e-9 * (high - low)
    places = [float(v) for v in locator.tick_values(low, high) if low - slack <= v <= high + slack]
    step = min((b - a for a, b in pairwise(places)), default=abs(high - low) or 1.0)
    grouped = max(abs(low), abs(high)) >= 10_000
    return places, [tick_text(v, step, grouped) for v in places]


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
    low, high = sorted(axes.get_xlim() if which == "x" else axes.get_ylim())
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
    page: Any = axes.figure
    width, height = page.get_size_inches() * 72
    box = axes.get_position()
    left, stop, bottom, top = box.x0 * width, box.x1 * width, box.y0 * height, box.y1 * height
    (start, end), (first, last) = (axes.get_xlim(), (left, stop)) if which == "x" else (axes.get_ylim(), (bottom, top))
    at = [first + (place - start) / (end - start) * (last - first) for place in places]
    if which == "x":
        marks = [((x, bottom), (x, bottom - _TICK)) for x in at]
        across = [((x, bottom), (x, top)) for x in at]
    else:
        edge, way = (stop, 1.0) if right else (left, -1.0)
        marks = [((edge, y), (edge + way * _TICK, y)) for y in at]
        across = [((left, y), (stop, y)) for y in at]
    _strokes(page, marks, INK, 2.5)
    if grid:
        _strokes(page, across, GRID, -1.0)
    for px, text in zip(at, texts, strict=True):
        if text and which == "x":
            text_at(page, px, height - bottom + _TICK + 4 + FONT * 0.78, text, ha="center")
        elif text:
            beside = edge + way * (_TICK + 4)
            text_at(page, beside, height - px + FONT * 0.36, text, ha="left" if right else "right")


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


def draw_legend(page: MplFigure, rows: Sequence[Sequence[tuple[float, LegendEntry]]], left: float, top: float) -> None:
    """Draw the rows of a legend, 20 px apart.

    Parameters
    ----------
    rows : from ``legend_rows``. left, top : upper left corner of the legend, px.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Rectangle

    height = page.get_size_inches()[1] * 72
    for number, row in enumerate(rows):
        middle = height - (top + 20 * number + 10)
        for at, key in row:
            x = left + at
            if key.look == "patch":
                page.add_artist(
                    Rectangle((x, middle - 5), 26, 10, color=key.color, alpha=key.alpha, lw=0, transform=None)
                )
            elif key.look == "points":
                page.add_artist(Line2D([x + 13], [middle], marker="o", ms=6, color=key.color, lw=0, transform=None))
            else:
                page.add_artist(
                    Line2D(
                        [x, x + 26],
                        [middle, middle],
                        color=key.color,
                        lw=key.width,
                        ls=key.dashes,
                        alpha=key.alpha,
                        transform=None,
                    )
                )
            text_at(page, x + 33, top + 20 * number + 14.5, key.label)


def label_room(text: str, size: float = FONT) -> float:
    """Approximate width, px, of a text with the font size ``size``, px."""
    return len(text) * _CHARACTER * size / FONT


_TAG = re.compile(r"<[^>]+>")
_TENTHS = re.compile(r"(?<=\.\d)\d+")
_WHOLE = re.compile(r"\.0(?!\d)")
_DOT = re.compile(r"M(-?[\d.]+ -?[\d.]+)L\1(?=[M\"])")
_PLACES = re.compile(r' (?:d|x|y)="[^"]*"')
_FONT = re.compile(r" font-family: [^;\"]*;?|;\s*(?=\")")
_UPRIGHT = re.compile(r' transform="rotate\(-0 [^"]*\)"')
_HEAD = re.compile(r"<svg[^>]*viewBox=\"([^\"]*)\"[^>]*>")
_DROPPED = re.compile(r"\s*<metadata>.*?</metadata>|\s*<defs>\s*<style.*?</style>\s*</defs>|<!--.*?-->", re.DOTALL)


def to_svg(page: MplFigure, label: str, name: str) -> str:
    """The figure as an SVG element for a page: no prolog, no metadata, ids that start with ``name``, short numbers.

    Parameters
    ----------
    label : text for screen readers. name : prefix of the ids, unique on the page.
    """
    from matplotlib.backends.backend_svg import FigureCanvasSVG

    stream = io.StringIO()
    backend: Any = FigureCanvasSVG(page)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # about glyphs that matplotlib's font lacks; the browser has them
        backend.print_svg(stream, metadata={"Date": None, "Creator": None})
    text = stream.getvalue()
    text = _DROPPED.sub("", text[text.index("<svg") :])
    prefix = re.sub(r"[^A-Za-z0-9]+", "-", name)
    text = _TAG.sub(lambda tag: _lean(tag[0], prefix), text)
    text = re.sub(r">\s+<", "><", text).strip().replace("<g/>", "").replace("<g></g>", "")
    width, height = page.get_size_inches() * 72
    head = (
        f'<svg class="plot" viewBox="0 0 {width:.0f} {height:.0f}" style="max-width:{width:.0f}px" role="img" '
        f'aria-label="{escape(typography.clean(label))}">'
    )
    return _HEAD.sub(lambda _: head, text, count=1)


def _lean(tag: str, prefix: str) -> str:
    """One tag without attributes that only an editor needs, and with the prefix in its ids."""
    if tag.startswith(("<svg", "</")):
        return tag
    tag = re.sub(r' id="[^"]*"', "", tag, count=1) if tag.startswith("<g ") else tag.replace(' id="', f' id="{prefix}-')
    tag = tag.replace("xlink:href", "href")
    tag = tag.replace('href="#', f'href="#{prefix}-').replace("url(#", f"url(#{prefix}-")
    if tag.startswith("<image"):
        return tag
    tag = _FONT.sub("", tag)
    if "rotate(-0 " in tag:
        tag = _UPRIGHT.sub("", tag)
    return _PLACES.sub(_rounded, tag)


def _rounded(attribute: re.Match[str]) -> str:
    """Coordinates to a tenth of a px, path commands without needless spaces, a dot as a stroke of zero length."""
    text = _WHOLE.sub("", _TENTHS.sub("", attribute[0]))
    text = text.replace("\n", "").replace("M ", "M").replace(" L", "L").replace("L ", "L").replace(" M", "M")
    return _DOT.sub(r"M\1h0", text)
