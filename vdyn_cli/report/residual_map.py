"""Color map of the mean residual of every run over x and over the measured value, to locate model errors."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.report import canvas, decimation, typography
from vdyn_cli.report.canvas import PlotArea
from vdyn_cli.report.panels import ChannelTraces, RunTrace

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.colors import Colormap
    from matplotlib.figure import Figure as MplFigure

    from vdyn_cli.quantities.arrays import Array

WIDTH = 1240.0
_BINS = 32
_LEFT, _GAP, _RIGHT, _TOP, _BOTTOM = 130.0, 26.0, 96.0, 30.0, 46.0
_SHADES = 41
_LEAST, _SHARE = 3, 1 / 8  # smallest number of samples per cell, and smallest share of the mean number per cell


def has_map(channel: ChannelTraces) -> bool:
    """Whether there are runs to compare: at least two with 60 samples or more, about two per bin."""
    return sum(int(np.count_nonzero(np.isfinite(t.residual) & np.isfinite(t.x)) >= 60) for t in channel.traces) >= 2


def map_svg(channel: ChannelTraces, name: str, limit: float) -> str:
    """Draw the mean residual per run and bin, twice: over x, and over the measured value.

    Parameters
    ----------
    name : prefix of the ids of the SVG element.
    limit : the residual with full color, in the unit of the channel; 0: from the channel.
    """
    traces = channel.traces
    row = float(np.clip(320 / len(traces), 4, 22))
    tall = row * len(traces)
    half = (WIDTH - _LEFT - _GAP - _RIGHT) / 2
    along, over = _along_and_over(channel)
    limit = limit or _limit(channel, along[1], over[1])
    with canvas.style():
        page = canvas.new_figure(WIDTH, _TOP + tall + _BOTTOM)
        unit = f", {typography.unit(channel.unit)}" if channel.unit else ""
        for number, ((edges, cells), label) in enumerate(
            ((along, typography.prose(channel.x_label)), (over, f"measured {typography.name(channel.name)}{unit}"))
        ):
            area = PlotArea(_LEFT + number * (half + _GAP), _TOP, half, tall)
            axes = canvas.add_axes(page, area, ("bottom",))
            _draw_cells(axes, edges, cells, limit)
            canvas.scale_axis(axes, "x", half, 70)
            canvas.text_at(page, area.left + half, _TOP + tall + 40, label, ha="right")
        canvas.text_at(page, 4, 14.5, f"mean of measured − simulated{unit}")
        _name_rows(page, traces, row)
        _draw_scale(page, PlotArea(WIDTH - _RIGHT + 22, _TOP, 14, max(tall, 66)), limit)
        return canvas.to_svg(page, f"Mean residual of the {typography.name(channel.name)}, run by run", name)


def caption(channel: ChannelTraces) -> str:
    """The caption: how to read the map."""
    return (
        f"Mean residual of the {typography.name(channel.name)}, one row per run. Left: along the run. Right: over the"
        " measured value. Good: pale, or colors without a pattern. Bad: one color down a column (an error that all runs"
        " share), or rows that alternate with the direction (wind or grade)."
    )


def limit(channel: ChannelTraces) -> float:
    """The residual with full color in the map of this channel, in the channel's unit."""
    along, over = _along_and_over(channel)
    return _limit(channel, along[1], over[1])


def _along_and_over(channel: ChannelTraces) -> tuple[tuple[Array, Array], tuple[Array, Array]]:
    traces = channel.traces
    return _cells(traces, [t.x for t in traces]), _cells(traces, [t.measured for t in traces])


def _cells(traces: tuple[RunTrace, ...], positions: list[Array]) -> tuple[Array, Array]:
    """Edges (bins+1,) and mean residuals (runs, bins)."""
    known = np.concatenate([p[np.isfinite(p) & t.used] for p, t in zip(positions, traces, strict=True)])
    if not known.size:
        known = np.concatenate([p[np.isfinite(p)] for p in positions] + [np.zeros(1)])
    low, high = float(known.min()), float(known.max())
    if high <= low:
        high = low + 1.0
    edges = np.linspace(low, high, _BINS + 1)
    return edges, np.stack([_row(p, t, edges) for p, t in zip(positions, traces, strict=True)])


def _row(position: Array, one: RunTrace, edges: Array) -> Array:
    return decimation.means(position, one.residual, edges, max(_LEAST, int(_SHARE * one.x.size / _BINS)))


def _limit(channel: ChannelTraces, *cells: Array) -> float:
    """The residual with full color: the 98 % quantile of the cells, at least the noise floor."""
    size = np.abs(np.concatenate([c.ravel() for c in cells]))
    size = size[np.isfinite(size)]
    return max(float(np.percentile(size, 98)) if size.size else 0.0, channel.noise or 0.0) or 1.0


def _draw_cells(axes: Axes, edges: Array, cells: Array, limit: float) -> None:
    rows = np.arange(cells.shape[0] + 1, dtype=float)
    _fill(axes, edges, rows, cells, limit)
    axes.set(xlim=(edges[0], edges[-1]), ylim=(rows[-1], 0))


def _fill(axes: Axes, x: Array, y: Array, cells: Array, limit: float) -> None:
    """Color the cells (rows, columns) between edges x and y: one path per shade, equal neighbors in a row merged."""
    from matplotlib.patches import PathPatch
    from matplotlib.path import Path

    colors, known = _colors(), np.isfinite(cells)
    share = 0.5 + 0.5 * np.where(known, cells, 0.0) / limit
    shade = np.where(known, np.clip((share * _SHADES).astype(int), 0, _SHADES - 1), -1)
    corners: dict[int, list[Array]] = {}
    for row, one in enumerate(shade):
        starts = np.flatnonzero(np.diff(one, prepend=-2))
        for left, right in zip(starts, np.append(starts[1:], one.size), strict=True):
            x0, x1, y0, y1 = x[left], x[right], y[row], y[row + 1]
            corners.setdefault(int(one[left]), []).append(np.array([(x0, y0), (x1, y0), (x1, y1), (x0, y1), (x0, y0)]))
    codes = [Path.MOVETO, Path.LINETO, Path.LINETO, Path.LINETO, Path.CLOSEPOLY]
    for number in sorted(set(corners) - {-1}):
        rectangles = corners[number]
        outline = Path(np.concatenate(rectangles), codes * len(rectangles))
        axes.add_artist(PathPatch(outline, facecolor=colors(number), linewidth=0, antialiased=False))


def _colors() -> Colormap:
    from matplotlib.colors import LinearSegmentedColormap

    shades = ["#00456b", canvas.BLUE, "#a6cfe8", "#f7f7f5", "#f3c39c", canvas.VERMILLION, "#7a3500"]
    return LinearSegmentedColormap.from_list("residual", shades, N=_SHADES)


def _name_rows(page: MplFigure, traces: tuple[RunTrace, ...], row: float) -> None:
    stride = max(int(np.ceil(14 / row)), 1)
    for number in range(0, len(traces), stride):
        name = typography.shortened(traces[number].run, 16)
        canvas.text_at(page, _LEFT - 8, _TOP + (number + 0.5) * row + 4.5, name, 12, ha="right")


def _draw_scale(page: MplFigure, area: PlotArea, limit: float) -> None:
    axes = canvas.add_axes(page, area, ())
    edges = np.linspace(-limit, limit, 22)
    middle = 0.5 * (edges[1:] + edges[:-1])
    _fill(axes, np.array([0.0, 1.0]), edges, middle[:, None], limit)
    axes.set_xlim(0, 1)
    axes.set_ylim(-limit, limit)
    canvas.scale_axis(axes, "y", area.height, 40, right=True)
