"""The standard figure of every step: measured and simulated above, the residual below, the runs side by side."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.constants import NORMAL95
from vdyn_cli.report import canvas, decimation, typography
from vdyn_cli.report.canvas import LegendEntry, PlotArea
from vdyn_cli.report.figures import dots, padded
from vdyn_cli.report.panels import ChannelTraces, Panel, RunTrace, drawn_traces, judged_residual, lay_out

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure as MplFigure
    from numpy.typing import NDArray

    from vdyn_cli.quantities.arrays import Array

WIDTH = 1240.0
_LEFT, _RIGHT = 72.0, 14.0
_STRIP = WIDTH - _LEFT - _RIGHT
_ABOVE, _BELOW, _BETWEEN, _BOTTOM = 250.0, 140.0, 34.0, 46.0
_BAND = NORMAL95  # of the noise floor
_MEASURED = LegendEntry("measured", canvas.PALE, width=3.6)
_SIMULATED = LegendEntry("simulated", canvas.BLUE, width=1.6)
_BEFORE = LegendEntry("simulated before the extension", canvas.VERMILLION, dashes=(0, (5, 2)), width=1.4)


def comparison_svg(channel: ChannelTraces, name: str) -> str:
    """Draw one channel as SVG: the runs side by side, one panel each, with the residuals below."""
    traces = drawn_traces(channel.traces)
    panels = lay_out(traces, _STRIP)
    unit = f", {typography.unit(channel.unit)}" if channel.unit else ""
    title = typography.name(channel.name) + unit
    aside = max(_LEFT, 34 + canvas.label_room(title))
    keys = canvas.legend_rows(_legend(channel, traces), WIDTH - aside)
    top = 52.0 + 20.0 * (len(keys) - 1)
    rows = _residual_rows(channel, traces)
    height = top + _ABOVE + len(rows) * (_BETWEEN + _BELOW) + _BOTTOM
    with canvas.style():
        page = canvas.new_figure(WIDTH, height)
        canvas.draw_legend(page, keys, aside, 0)
        canvas.text_at(page, 4, 14.5, title)
        canvas.text_at(page, WIDTH - _RIGHT, height - 6, typography.prose(channel.x_label), ha="right")
        _draw_runs(page, traces, panels, top)
        for number, (title, limit, before) in enumerate(rows):
            area = PlotArea(_LEFT, top + _ABOVE + _BETWEEN + number * (_BETWEEN + _BELOW), _STRIP, _BELOW)
            canvas.text_at(page, 4, area.top - 8, title + unit)
            axes = _draw_residuals(page, panels, area, limit, before, channel.noise)
            if number == len(rows) - 1:
                _x_ticks(axes, panels)
        return canvas.to_svg(page, f"{typography.name(channel.name)}: measured, simulated and residual", name)


def _residual_rows(channel: ChannelTraces, traces: tuple[RunTrace, ...]) -> list[tuple[str, float, bool]]:
    """The residual rows: title, limit of the scale, whether they include the residual before the extension.

    If the extension removes most of the residual, the remainder has a row with its own scale.
    """
    least = 3 * (channel.noise or 0.0)
    after = max(_limit([judged_residual(t) for t in traces]), least)
    before = _limit([t.before for t in traces if t.before is not None])
    title = "measured − simulated"
    if before <= 2.5 * after:
        return [(title, max(after, before) or 1.0, True)]
    return [(f"{title}, before and after the extension", before, True), ("after the extension, enlarged", after, False)]


def _limit(residuals: list[Array]) -> float:
    """The 99.8 % quantile of the absolute residual, robust against single outliers; 0 without samples."""
    size = np.abs(np.concatenate([*residuals, np.empty(0)]))
    size = size[np.isfinite(size)]
    return float(np.percentile(size, 99.8)) if size.size else 0.0


def _legend(channel: ChannelTraces, traces: tuple[RunTrace, ...]) -> list[LegendEntry]:
    keys = [_MEASURED, _SIMULATED]
    if any(t.baseline is not None for t in traces):
        keys.append(_BEFORE)
    if any(_smoothable(t) for t in traces):
        keys.append(LegendEntry("residual (running mean dark)", canvas.SKY, width=1.2))
    if channel.noise is not None:
        keys.append(LegendEntry("noise floor, 95 %", canvas.GREEN, "patch", alpha=0.2))
    if any(t.held_out for t in traces):
        keys.append(LegendEntry("held-out run", canvas.HELD_OUT, "patch"))
    return keys


def _draw_runs(page: MplFigure, traces: tuple[RunTrace, ...], panels: tuple[Panel, ...], top: float) -> None:
    """The upper row: the names of the runs, and below them measured and simulated."""
    seen = [v[np.isfinite(v)] for t in traces for v in (t.measured, t.simulated, t.baseline) if v is not None]
    values = np.concatenate([*seen, np.empty(0)])
    axes = canvas.add_axes(page, PlotArea(_LEFT, top, _STRIP, _ABOVE))
    axes.set(xlim=(0, _STRIP), ylim=padded(float(values.min()), float(values.max()), 0.05) if values.size else (0, 1))
    canvas.scale_axis(axes, "y", _ABOVE, 42, grid=True)
    for panel in panels:
        _draw_run(axes, panel)
        _mark(axes, panel)
        name = typography.shortened(panel.trace.run, max(int(panel.width / canvas.label_room("x", 12)), 2))
        canvas.text_at(page, _LEFT + panel.left + 0.5 * panel.width, top - 8, name, 12, canvas.GRAY, ha="center")


def _draw_residuals(
    page: MplFigure, panels: tuple[Panel, ...], area: PlotArea, limit: float, before: bool, noise: float | None
) -> Axes:
    axes = canvas.add_axes(page, area, ("left",))
    axes.set(xlim=(0, area.width), ylim=(-1.08 * limit, 1.08 * limit))
    canvas.scale_axis(axes, "y", area.height, 30, grid=True)
    for panel in panels:
        _draw_residual(axes, panel, before)
        _mark(axes, panel)
    if noise is not None:
        axes.axhspan(-_BAND * noise, _BAND * noise, color=canvas.GREEN, alpha=0.2, lw=0, zorder=1.2)
        edges = (-_BAND * noise, _BAND * noise) if _BAND * noise > 0.1 * limit else ()
        for edge in edges:
            axes.axhline(edge, color=canvas.DARK_GREEN, lw=1, ls=(0, (4, 2)), zorder=2.9)
    axes.axhline(0, color=canvas.INK, lw=0.8, zorder=4)
    return axes


def _draw_run(axes: Axes, panel: Panel) -> None:
    one, area = panel.trace, PlotArea(0, 0, panel.width, _ABOVE)
    if one.rising:
        for used, color in ((True, canvas.CLOUD), (False, "#d9d9d9")):
            _line(
                axes, panel, _where(one.measured, one.used == used), LegendEntry("", color, width=_MEASURED.width), 2.0
            )
        _line(axes, panel, one.simulated, _SIMULATED, 3.0)
        if one.baseline is not None:
            _line(axes, panel, one.baseline, _BEFORE, 2.5)
        return
    dots(axes, panel.px(one.x), one.measured, canvas.CLOUD, area, 2.0)
    order = np.argsort(one.x, kind="stable")
    for values, key, level in ((one.simulated, _SIMULATED, 3.0), (one.baseline, _BEFORE, 2.5)):
        if values is not None:
            x, y = decimation.envelope(
                *decimation.connected(panel.px(one.x)[order], values[order], np.inf), int(panel.width)
            )
            axes.plot(x, y, color=key.color, lw=key.width, ls=key.dashes, zorder=level)


def _draw_residual(axes: Axes, panel: Panel, before: bool) -> None:
    one = panel.trace
    unused = ~one.used if one.used.any() else np.zeros(one.used.size, dtype=bool)
    if unused.any():
        _samples(axes, panel, _where(one.residual, unused), "#d0d0d0", 1.9)
    both = [(_where(one.residual, ~unused), canvas.SKY, canvas.BLUE, 2.2)]
    if before and one.before is not None:
        both.append((one.before, "#f3c79f", canvas.VERMILLION, 2.0))
    for residual, pale, dark, level in both:
        smooth = _smoothable(one)
        _samples(axes, panel, residual, pale if smooth else dark, level)
        if smooth:
            _running_mean(axes, panel, residual, dark, level + 1.2)


def _samples(axes: Axes, panel: Panel, residual: Array, color: str, level: float) -> None:
    """Draw a residual as a line if x never decreases, else as dots."""
    if panel.trace.rising:
        _line(axes, panel, residual, LegendEntry("", color, width=0.9), level)
    else:
        dots(axes, panel.px(panel.trace.x), residual, color, PlotArea(0, 0, panel.width, _BELOW), level)


def _running_mean(axes: Axes, panel: Panel, residual: Array, color: str, level: float) -> None:
    edges = np.linspace(0, panel.width, _bins(panel) + 1) + panel.left
    middle = 0.5 * (edges[1:] + edges[:-1])
    axes.plot(middle, decimation.means(panel.px(panel.trace.x), residual, edges, 3), color=color, lw=2, zorder=level)


def _bins(panel: Panel) -> int:
    return int(np.clip(panel.width / 9, 6, 60))


def _smoothable(one: RunTrace) -> bool:
    return bool(np.count_nonzero(np.isfinite(one.residual)) >= 200)


def _where(values: Array, mask: NDArray[np.bool_]) -> Array:
    return np.where(mask, values, np.nan)


def _line(axes: Axes, panel: Panel, values: Array, key: LegendEntry, level: float) -> None:
    x, y = decimation.envelope(*decimation.connected(panel.px(panel.trace.x), values), max(int(panel.width), 40))
    if np.count_nonzero(np.isfinite(y)) == 1:
        axes.plot(x, y, color=key.color, marker="o", ms=5, lw=0, zorder=level)
    elif x.size:
        axes.plot(x, y, color=key.color, lw=key.width, ls=key.dashes, zorder=level, solid_joinstyle="round")


def _mark(axes: Axes, panel: Panel) -> None:
    """Draw the background of a held-out run, and the line between neighboring panels."""
    if panel.trace.held_out:
        axes.axvspan(panel.left, panel.left + panel.width, color=canvas.HELD_OUT, lw=0, zorder=0.5)
    if panel.left:
        axes.axvline(panel.left - 5, color=canvas.CLOUD, lw=0.8, zorder=1)


def _x_ticks(axes: Axes, panels: tuple[Panel, ...]) -> None:
    """Draw the scale of each panel, without tick labels that would overlap the previous one."""
    at, texts = [], []
    free = -np.inf
    for panel in panels:
        places, labels = canvas.ticks(panel.start, panel.end, panel.width, 55)
        for place, label in zip(places, labels, strict=True):
            px = float(panel.px(np.array([place]))[0])
            half = 0.5 * canvas.label_room(label) + 4
            shown = px - half >= free
            at.append(px)
            texts.append(label if shown else "")
            free = px + half if shown else free
    canvas.draw_ticks(axes, "x", at, texts)


def caption(channel: ChannelTraces) -> str:
    """The caption: what the figure shows, with numbers of these runs, and how good and bad fits look."""
    traces = drawn_traces(channel.traces)
    text = f"Above: measured (gray) and simulated (blue) {typography.name(channel.name)}, {_beside(traces)}."
    text += " Below: measured − simulated."
    if len(traces) < len(channel.traces):
        text += f" Shown: {len(traces)} of {len(channel.traces)} runs, those with the smallest, middle and largest rms."
    if channel.noise is not None:
        left = np.concatenate([judged_residual(t) for t in channel.traces] or [np.empty(0)])
        left = left[np.isfinite(left)]
        if left.size:
            share = 100 * float(np.mean(np.abs(left) <= _BAND * channel.noise))
            text += f" {share:.0f} % of the samples lie inside the 95 % noise band."
    if channel.extended:
        text += f" {_rms_change(channel)}"
    good = "fills the noise band" if channel.noise is not None else "looks like noise"
    return text + (
        f" Good: the residual {good}, its running mean is near zero, and all runs look alike. Bad: a slope, a peak at"
        " the same place in every run, or a sign that changes with the direction: the model lacks a force or a sensor"
        " error."
    )


def _beside(traces: tuple[RunTrace, ...]) -> str:
    if len(traces) == 1:
        return "one run"
    return f"{len(traces)} runs side by side" + (", each with its own time axis" if traces and traces[0].rising else "")


def _rms_change(channel: ChannelTraces) -> str:
    """A sentence on the rms before and after the extension, over the held-out runs if there are any, else over all."""
    extended = [t for t in channel.traces if t.before is not None]
    unseen = [t for t in extended if t.held_out]
    compared = unseen or extended
    before = rms(*(t.before for t in compared if t.before is not None))
    after = rms(*(t.residual for t in compared))
    where = "On the held-out runs" if unseen else "On these runs"
    numbers = f"{typography.significant(before, 2)} to {typography.quantity(after, channel.unit, 2)}"
    return f"{where} the extension changes the rms from {numbers}."
