"""Figure of the flags of runs over time: one row per run, with its main channel and a strip per flagged channel."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from vdyn_cli.io.quality.cuts import CutLog
from vdyn_cli.quantities.cut_ledger import LedgerRow
from vdyn_cli.quantities.quality_flags import EVERY, Flag
from vdyn_cli.quantities.quantity import from_si
from vdyn_cli.quantities.vocabulary import CHANNELS
from vdyn_cli.report import decimation, typography
from vdyn_cli.report.canvas import (
    INK,
    ORANGE,
    PURPLE,
    VERMILLION,
    LegendEntry,
    PlotArea,
    add_axes,
    draw_legend,
    legend_rows,
    new_figure,
    scale_axis,
    style,
    text_at,
    to_svg,
)

MOST_RUNS = 12  # runs in one figure, which then fits on a printed page
_WIDTH, _LEFT, _TRACE, _STRIP, _TICKS = 1150.0, 190.0, 64.0, 14.0, 34.0  # px
_NAME = 24  # characters shown of a run's or a channel's name
_KEYS = (
    LegendEntry("measured", INK),
    LegendEntry("cut", VERMILLION, "patch"),
    LegendEntry("suspect, used", ORANGE, "patch"),
    LegendEntry("failed, kept by the description", PURPLE, "patch"),
)
_COLORS = {"cut": VERMILLION, "marked": ORANGE, "kept": PURPLE}
FlagSegments = dict[str, list[tuple[float, float, str]]]


def main_channel(one: CutLog) -> str:
    """The channel to draw: a speed if there is one, else the first channel with values, else empty."""
    speeds = [n for n in ("speed", "vehicle_speed", "wheel_speed") if n in one.whole]
    known = [n for n in one.whole.channels if np.isfinite(one.whole[n]).any()]
    return next(iter([*speeds, *known]), "")


def flag_segments(one: CutLog) -> FlagSegments:
    """First time, last time (s) and kind of each flagged segment, by channel.

    Parameters
    ----------
    one : a run, whole and cut. Its ledger has the segments cut or, by the description, kept; its flags those marked as
        suspect.
    """
    found: FlagSegments = {}
    for row in one.ledger:
        found.setdefault(row.channel, []).append((row.start, row.stop, _kind(row)))
    for fault in one.flags.faults:
        if fault.state == Flag.SUSPECT:
            span = (float(one.whole.time[fault.first]), float(one.whole.time[fault.stop - 1]))
            found.setdefault(fault.channel, []).append((*span, "marked"))
    return found


def _kind(row: LedgerRow) -> str:
    return "kept" if row.decision == "kept" else "cut"


def flag_figures(runs: Sequence[CutLog], units: Mapping[str, str]) -> list[str]:
    """SVG figures of up to 12 runs each.

    Parameters
    ----------
    units : unit in which each channel's numbers are shown, from the description; SI for others.
    """
    return [_figure(runs[k : k + MOST_RUNS], k, units) for k in range(0, len(runs), MOST_RUNS)]


def _figure(runs: Sequence[CutLog], first: int, units: Mapping[str, str]) -> str:
    found = [flag_segments(one) for one in runs]
    heights = [_TRACE + _STRIP * len(each) + _TICKS for each in found]
    rows = legend_rows(_KEYS, _WIDTH - _LEFT)
    top = 20.0 * len(rows) + 10.0
    with style():
        page = new_figure(_WIDTH, top + sum(heights))
        draw_legend(page, rows, _LEFT, 0.0)
        for one, each, height in zip(runs, found, heights, strict=True):
            _draw_run(page, one, each, top, units)
            top += height
        return to_svg(page, "Flags of the runs over time", f"flags-{first}")


def _draw_run(page: object, one: CutLog, found: FlagSegments, top: float, units: Mapping[str, str]) -> None:
    from matplotlib.figure import Figure as MplFigure

    assert isinstance(page, MplFigure)
    name, time = main_channel(one), one.whole.time
    height = _TRACE + _STRIP * len(found) - 6.0
    axes = add_axes(page, PlotArea(_LEFT, top, _WIDTH - _LEFT - 12.0, height))
    start, stop = float(time[0]), float(time[-1])
    axes.set_xlim(start, max(stop, start + 1e-9))
    values = one.whole[name] if name else np.full(time.size, np.nan)
    known = values[np.isfinite(values)]
    low, high = (float(known.min()), float(known.max())) if known.size else (0.0, 1.0)
    span = (high - low) or abs(high) or 1.0
    strip = span * _STRIP / (_TRACE - 6.0)
    axes.set_ylim(low - strip * len(found), high + 0.04 * span)
    least = (stop - start) * 1.5 / (_WIDTH - _LEFT)  # s, at least 1.5 px, so that a spike is visible
    for k, (channel, segments) in enumerate(found.items()):
        bottom = low - strip * (k + 0.85)
        for a, b, kind in segments:
            wide = max(b - a, least)
            axes.broken_barh([(a, wide)], (bottom, 0.7 * strip), color=_COLORS[kind], linewidth=0)
            if channel in (name, EVERY):
                axes.axvspan(a, a + wide, color=_COLORS[kind], alpha=0.25, linewidth=0)
        shown = "all channels" if channel == EVERY else typography.name(channel)
        place = top + height - _STRIP * (len(found) - k) + 11.0
        text_at(page, 0.0, place, typography.shortened(shown, _NAME), size=11.0)
    x, y = decimation.envelope(time, values, int(_WIDTH - _LEFT))
    axes.plot(x, y, color=INK, linewidth=1.0)
    scale_axis(axes, "x", _WIDTH - _LEFT, 90.0)
    text_at(page, 0.0, top + 14.0, typography.shortened(typography.run_name(one.log.name), _NAME))
    si = CHANNELS[name].unit if name in CHANNELS else ""
    unit = units.get(name, si)
    ends = " to ".join(typography.significant(from_si(x, unit, si), 3) for x in (low, high))
    limits = f"{typography.name(name)} {ends} {typography.unit(unit)}".rstrip()
    text_at(page, 0.0, top + 32.0, typography.shortened(limits, 34), size=11.0)
