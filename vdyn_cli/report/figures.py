"""Draws a step's figures, which are data (``result.Figure``), as SVG."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.quantities.result import Figure, Series
from vdyn_cli.report import canvas, decimation, typography
from vdyn_cli.report.canvas import LegendEntry, PlotArea

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from numpy.typing import NDArray

    from vdyn_cli.quantities.arrays import Array

WIDTH, PLOT_HEIGHT = 600.0, 270.0
_LEFT, _RIGHT, _BOTTOM = 68.0, 16.0, 48.0
_DOTS = 3000  # points of one series; more would overlap
_IMAGE = 640  # px, the longer side of an image

# Color and dash of the first, second ... series of a role.
_ROLES: dict[str, tuple[str, ...]] = {
    "measured": (canvas.INK, canvas.GRAY, canvas.PURPLE, canvas.GREEN),
    "simulated": (canvas.BLUE, canvas.SKY, canvas.PURPLE, canvas.GREEN),
    "baseline": (canvas.VERMILLION, canvas.ORANGE),
    "residual": (canvas.BLUE, canvas.VERMILLION, canvas.GREEN, canvas.PURPLE),
    "accent": (canvas.VERMILLION, canvas.PURPLE, canvas.GREEN, canvas.BLUE),
    "muted": (canvas.PALE, canvas.GRAY),
    "reference": (canvas.GREEN, canvas.PURPLE, canvas.ORANGE),
}
_DASHES: tuple[str | tuple[float, tuple[float, ...]], ...] = ("-", (0, (6, 2)), (0, (2, 2)), (0, (7, 2, 1.5, 2)))


def figure_svg(figure: Figure, name: str = "") -> str:
    """Draw a figure as one SVG element; the same figure gives the same text.

    Parameters
    ----------
    name : prefix of the ids of the element; empty: the key of the figure.
    """
    looks = _looks(figure.series)
    keys = _keys(figure.series, looks)
    rows = canvas.legend_rows(keys, WIDTH - _LEFT) if len(keys) > 1 else []
    top = 34.0 + 20.0 * len(rows)
    area = PlotArea(_LEFT, top, *_plot_size(figure))
    with canvas.style():
        page = canvas.new_figure(WIDTH, top + area.height + _BOTTOM)
        canvas.draw_legend(page, rows, 4, 0)
        axes = canvas.add_axes(page, area)
        picture = None if figure.image is None else _picture(figure.image)
        limits = _limits(figure)
        if limits is None and picture is None:
            canvas.text_at(page, area.left + 12, area.top + 24, "No data.", color=canvas.GRAY)
        else:
            _frame(axes, figure, limits, area)
            if picture is not None and figure.image is not None:
                rows_px, columns_px = figure.image.shape[:2]
                extent = (-0.5, columns_px - 0.5, rows_px - 0.5, -0.5)
                axes.imshow(picture, extent=extent, aspect="auto", interpolation="none", zorder=0)
            for series, key in zip(figure.series, looks, strict=True):
                _draw(axes, series, key, area)
            canvas.scale_axis(axes, "x", area.width, 70)
            canvas.scale_axis(axes, "y", area.height, 42, grid=picture is None)
        canvas.text_at(page, 4, top - 12, typography.prose(figure.y_label))
        canvas.text_at(page, WIDTH - _RIGHT, top + area.height + 40, typography.prose(figure.x_label), ha="right")
        return canvas.to_svg(page, figure.title, name or figure.key)


def _plot_size(figure: Figure) -> tuple[float, float]:
    """Width and height of the axes, px; for an image, such that its pixels are square."""
    room = WIDTH - _LEFT - _RIGHT
    if figure.image is not None and figure.image.size:
        rows, columns = figure.image.shape[:2]
        height = float(np.clip(room * rows / columns, 120, 420))
        return min(room, height * columns / rows), min(height, room * rows / columns)
    return room, 380.0 if figure.equal_axes else PLOT_HEIGHT


def _looks(series: Sequence[Series]) -> list[LegendEntry]:
    """Color and line style of every series; series with the same role and label share them."""
    seen: dict[str, list[str]] = {}
    looks = []
    for one in series:
        label = typography.run_name(typography.prose(one.label))
        known = seen.setdefault(one.role + "/band" * (one.kind == "band"), [])
        mark = label or "#"
        if mark not in known:
            known.append(mark)
        index = known.index(mark)
        colors = _ROLES[one.role]
        turn, color = divmod(index, len(colors))
        dashes = _DASHES[turn % len(_DASHES)] if turn or one.role not in ("baseline", "reference") else _DASHES[1]
        look = {"points": "points", "band": "patch", "bars": "patch"}.get(one.kind, "line")
        alpha = 0.22 if one.kind == "band" else 0.55 if one.kind == "bars" else 1.0
        looks.append(LegendEntry(typography.shortened(label, 64), colors[color], look, dashes, alpha=alpha))  # type: ignore[arg-type]
    return looks


def _keys(series: Sequence[Series], looks: Sequence[LegendEntry]) -> list[LegendEntry]:
    unique: dict[tuple[str, str, str], LegendEntry] = {}
    for one, key in zip(series, looks, strict=True):
        if key.label:
            unique.setdefault((key.label, key.color, one.kind), key)
    return list(unique.values())


def _limits(figure: Figure) -> tuple[float, float, float, float] | None:
    """Lowest and highest x and y of all series; None without finite values."""
    xs, ys = [], []
    for one in figure.series:
        x, y = decimation.finite(one.x), decimation.finite(one.y)
        n = min(x.size, y.size)
        xs.append(x[:n][np.isfinite(y[:n])])
        ys.append(y)
        if one.y2 is not None:
            ys.append(decimation.finite(one.y2))
        if one.error is not None:
            error = (
                np.resize(decimation.finite(one.error), n)
                if np.size(one.error) == 1
                else decimation.finite(one.error)[:n]
            )
            ys += [y[: error.size] - error, y[: error.size] + error]
        if one.kind == "bars":
            half = 0.5 * _bar_width(x)
            known = x[:n][np.isfinite(y[:n])]
            ys.append(np.zeros(min(known.size, 1)))
            xs += [known - half, known + half]
    flat_x, flat_y = (np.concatenate([*v, np.empty(0)]) for v in (xs, ys))
    flat_x, flat_y = flat_x[np.isfinite(flat_x)], flat_y[np.isfinite(flat_y)]
    if not flat_x.size or not flat_y.size:
        return None
    return float(flat_x.min()), float(flat_x.max()), float(flat_y.min()), float(flat_y.max())


def _frame(axes: Axes, figure: Figure, limits: tuple[float, float, float, float] | None, area: PlotArea) -> None:
    """Set the limits of the axes with a margin around the data."""
    if figure.image is not None:
        rows, columns = figure.image.shape[:2]
        axes.set(xlim=(-0.5, columns - 0.5), ylim=(rows - 0.5, -0.5))
    elif limits is not None:
        x0, x1, y0, y1 = limits
        bars = any(one.kind == "bars" for one in figure.series)
        axes.set_xlim(*padded(x0, x1, 0.02))
        axes.set_ylim(*((0.0, 1.06 * y1) if bars and y0 >= 0 < y1 else padded(y0, y1, 0.06)))
        if figure.equal_axes:
            _equalize(axes, area)


def padded(low: float, high: float, share: float) -> tuple[float, float]:
    """Limits with a margin of ``share`` of the span, also where all values are equal.

    Parameters
    ----------
    low, high : limits in data units. share : margin over span, 0 to 1.
    """
    span = high - low
    air = span * share if span > 1e-12 * max(abs(low), abs(high)) and span > 0 else 0.1 * abs(high) or 1.0
    return low - air, high + air


def _equalize(axes: Axes, area: PlotArea) -> None:
    """Widen the narrower range until a unit is as long in x as in y."""
    (x0, x1), (y0, y1) = axes.get_xlim(), axes.get_ylim()
    per_px = max((x1 - x0) / area.width, (y1 - y0) / area.height)
    for low, high, room, put in ((x0, x1, area.width, axes.set_xlim), (y0, y1, area.height, axes.set_ylim)):
        middle, half = 0.5 * (low + high), 0.5 * per_px * room
        put(middle - half, middle + half)


def _draw(axes: Axes, series: Series, key: LegendEntry, area: PlotArea) -> None:
    x, y = decimation.finite(series.x), decimation.finite(series.y)
    n = min(x.size, y.size)
    x, y = x[:n], y[:n]
    if not n:
        return
    order = 2.0 + {"band": 0.0, "bars": 0.1, "points": 0.5}.get(series.kind, 1.0) - (series.role == "muted")
    if series.kind == "band":
        _band(axes, x, y, decimation.finite(series.y2 if series.y2 is not None else np.zeros(n)), key, order)
    elif series.kind == "bars":
        axes.bar(x, y, width=_bar_width(x), color=key.color, alpha=key.alpha, linewidth=0, zorder=order)
    elif series.kind == "points":
        dots(axes, x, y, key.color, area, order)
    elif series.kind == "step":
        axes.step(x, y, where="mid", color=key.color, lw=key.width, ls=key.dashes, zorder=order)
    else:
        a, b = decimation.envelope(*decimation.connected(x, y), int(area.width))
        axes.plot(a, b, color=key.color, lw=key.width, ls=key.dashes, zorder=order, solid_joinstyle="round")
    if series.error is not None:
        error = np.broadcast_to(decimation.finite(series.error)[:n], (n,)) if np.size(series.error) in (1, n) else None
        if error is not None:
            _error_bars(axes, x, y, error, key.color, order)


def _band(axes: Axes, x: Array, y: Array, y2: Array, key: LegendEntry, order: float) -> None:
    n = min(x.size, y2.size)
    x, y, y2 = x[:n], y[:n], y2[:n]
    stride = -(-n // 1500)
    x, y, y2 = x[::stride], y[::stride], y2[::stride]
    known = np.isfinite(x) & np.isfinite(y) & np.isfinite(y2)
    axes.fill_between(x, y, y2, where=known.tolist(), color=key.color, alpha=key.alpha, linewidth=0, zorder=order)


def dots(axes: Axes, x: Array, y: Array, color: str, area: PlotArea, order: float) -> None:
    """Draw points as one path of round-capped dots, a tenth of the size of markers in the SVG.

    Parameters
    ----------
    x, y : (n,) in data units. area : place of the axes, px. order : drawing order of matplotlib (zorder).
    """
    # Many points are paler, so that a curve through them remains visible.
    if color == canvas.INK and np.count_nonzero(np.isfinite(x) & np.isfinite(y)) > 300:
        color = canvas.CLOUD
    chosen = decimation.cloud(x, y, (int(area.width / 1.5), int(area.height / 1.5)), _DOTS)
    count = chosen.size
    size = 7.0 if count <= 60 else 5.0 if count <= 300 else 3.4 if count <= 1000 else 2.4
    gap = np.full(count, np.nan)
    xs = np.stack([x[chosen], x[chosen], gap], axis=1).ravel()
    ys = np.stack([y[chosen], y[chosen], gap], axis=1).ravel()
    with canvas.every_stroke():
        axes.plot(xs, ys, color=color, lw=size, solid_capstyle="round", zorder=order)


def _error_bars(axes: Axes, x: Array, y: Array, error: Array, color: str, order: float) -> None:
    stride = -(-x.size // 400)
    x, y, error = x[::stride], y[::stride], error[::stride]
    gap = np.full(x.size, np.nan)
    xs = np.stack([x, x, gap], axis=1).ravel()
    ys = np.stack([y - error, y + error, gap], axis=1).ravel()
    axes.plot(xs, ys, color=color, lw=1.2, zorder=order - 0.01)


def _bar_width(x: Array) -> float:
    places = np.unique(x[np.isfinite(x)])
    return 0.8 * float(np.diff(places).min()) if places.size > 1 else 0.8


def _picture(image: NDArray[np.uint8]) -> NDArray[np.uint8] | None:
    """The image reduced to the size on the page by omitting rows and columns; None if it is empty."""
    if image.ndim < 2 or not image.size:
        return None
    stride = -(-max(image.shape[:2]) // _IMAGE)
    return np.ascontiguousarray(image[::stride, ::stride])
