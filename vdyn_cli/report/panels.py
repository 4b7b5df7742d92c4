"""Runs side by side in one row of the page, each in a panel with its own x scale."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.result import Comparison
from vdyn_cli.report import decimation, typography

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from vdyn_cli.quantities.arrays import Array

MOST_PANELS = 12  # panels in a row: each is then about 90 px wide, enough to see the shape of a run
_GAP = 10.0  # px between panels


@dataclass(frozen=True)
class RunTrace:
    """A comparison for drawing: arrays (n,) in the displayed unit.

    ``used`` marks the samples in the fit; ``baseline`` is the simulation before the extension (None without one).
    """

    run: str
    x: Array
    measured: Array
    simulated: Array
    baseline: Array | None
    used: NDArray[np.bool_]
    held_out: bool

    @cached_property
    def residual(self) -> Array:
        """Measured minus simulated, (n,), in the unit of the channel."""
        return self.measured - self.simulated

    @cached_property
    def before(self) -> Array | None:
        """Measured minus the simulation before the extension, None without one."""
        return None if self.baseline is None else self.measured - self.baseline

    @cached_property
    def rising(self) -> bool:
        """Whether x never decreases, like time; slip and angles do."""
        x = self.x[np.isfinite(self.x)]
        return bool(x.size < 2 or np.all(np.diff(x) >= 0))


@dataclass(frozen=True)
class ChannelTraces:
    """All runs of one channel in one unit; ``noise`` is the noise floor, None if unknown."""

    name: str
    unit: str
    x_label: str
    traces: tuple[RunTrace, ...]
    noise: float | None

    @property
    def extended(self) -> bool:
        """Whether the model was extended."""
        return any(t.baseline is not None for t in self.traces)

    def before(self) -> ChannelTraces:
        """The channel with the simulation before the extension in place of the final one."""
        traces = tuple(
            t if t.baseline is None else replace(t, simulated=t.baseline, baseline=None) for t in self.traces
        )
        return replace(self, traces=traces)


@dataclass(frozen=True)
class Panel:
    """The panel of a run: from ``start`` to ``end`` in x, ``left`` and ``width`` in px within the row."""

    trace: RunTrace
    start: float
    end: float
    left: float
    width: float

    def px(self, x: Array) -> Array:
        """Positions (n,) of x values (n,) in px from the left of the row."""
        return self.left + (x - self.start) / (self.end - self.start) * self.width


def channel_traces(comparisons: Sequence[Comparison], noise: float, noise_unit: str) -> tuple[ChannelTraces, ...]:
    """Group comparisons by channel, in everyday units, in the given order.

    Parameters
    ----------
    noise, noise_unit : the noise floor of the fit and its unit; channels with another unit have no noise floor.
    """
    groups: dict[tuple[str, str, str], list[Comparison]] = {}
    for one in comparisons:
        groups.setdefault((one.channel, one.unit, one.x_label), []).append(one)
    out = []
    for (channel, unit, x_label), members in groups.items():
        shown_unit, factor = _shown_unit(channel, unit)
        known = unit == noise_unit and np.isfinite(noise) and noise > 0
        traces = tuple(run_trace(one, factor) for one in members)
        out.append(ChannelTraces(channel, shown_unit, x_label, traces, noise * factor if known else None))
    return tuple(out)


def _shown_unit(channel: str, unit: str) -> tuple[str, float]:
    everyday = typography.everyday(unit)
    return everyday if everyday and (unit != "m/s" or "speed" in channel) else (unit, 1.0)


def run_trace(one: Comparison, factor: float) -> RunTrace:
    """A comparison as arrays of equal length; its values, but not x, are multiplied by ``factor``."""
    arrays = [decimation.finite(v) for v in (one.x, one.measured, one.simulated)]
    baseline = None if one.baseline is None else decimation.finite(one.baseline)
    used = None if one.used is None else np.asarray(one.used, dtype=bool).ravel()
    n = min(a.size for a in (*arrays, *(a for a in (baseline, used) if a is not None)))
    return RunTrace(
        typography.run_name(typography.clean(one.run)),
        arrays[0][:n],
        arrays[1][:n] * factor,
        arrays[2][:n] * factor,
        None if baseline is None else baseline[:n] * factor,
        np.ones(n, dtype=bool) if used is None else used[:n],
        one.held_out,
    )


def judged_residual(one: RunTrace) -> Array:
    """The residual (m,) of the samples in the fit; of all samples for a run that the fit does not use."""
    return one.residual[one.used] if one.used.any() else one.residual


def drawn_traces(traces: Sequence[RunTrace]) -> tuple[RunTrace, ...]:
    """The runs to draw, in order: all, or, of more than MOST_PANELS, those of smallest, middle and largest rms."""
    drawable = [i for i, t in enumerate(traces) if np.isfinite(t.x).any()]
    if len(drawable) <= MOST_PANELS:
        return tuple(traces[i] for i in drawable)
    sizes = np.nan_to_num(np.array([rms(judged_residual(traces[i])) for i in drawable]), nan=-1.0)
    ranked = np.argsort(sizes, kind="stable")
    third = MOST_PANELS // 3
    middle = (len(ranked) - third) // 2
    picks = {*ranked[:third].tolist(), *ranked[middle : middle + third].tolist(), *ranked[-third:].tolist()}
    return tuple(traces[drawable[i]] for i in sorted(picks))


def lay_out(traces: Sequence[RunTrace], width: float) -> tuple[Panel, ...]:
    """Divide the width of a row in proportion to the lengths of the runs; each has at least a third of an equal share.

    Parameters
    ----------
    width : of the row, px.

    Returns
    -------
    One panel per run, left to right; empty without runs.
    """
    if not traces:
        return ()
    ends = [(float(np.nanmin(t.x)), float(np.nanmax(t.x))) for t in traces]
    spans = np.array([b - a for a, b in ends])
    room = width - _GAP * (len(traces) - 1)
    shares = spans / spans.sum() if spans.sum() > 0 else np.full(spans.size, 1 / spans.size)
    shares = np.maximum(shares, 1 / (3 * spans.size))
    widths = room * shares / shares.sum()
    lefts = np.concatenate([[0.0], np.cumsum(widths + _GAP)[:-1]])
    panels = []
    for one, (a, b), left, wide in zip(traces, ends, lefts, widths, strict=True):
        half = 0.0 if b > a else 0.5 * (abs(a) or 1.0)  # draws a single sample in the middle
        panels.append(Panel(one, a - half, b + half, float(left), float(wide)))
    return tuple(panels)
