"""Figures of a bump test: measured and simulated loads, and residuals over stroke rate, stroke and load."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import PurePath

import numpy as np

from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.bump.known_car import ENDS
from vdyn_cli.steps.bump.replay import Replay

UNITS = {"front_load": "N", "rear_load": "N", "vertical_acceleration": "m/s^2", "pitch_rate": "rad/s"}
LINE = 800  # points of a loop, more than the pixels across a figure


def comparisons(replays: Sequence[Replay]) -> tuple[Comparison, ...]:
    """Measured and simulated channels over time, of every run."""
    return tuple(
        Comparison(r.run, n, UNITS[n], r.time, "time in s", measured, r.outputs[n], used=np.isfinite(measured))
        for r in replays
        for n, measured in r.measured.items()
    )


def figures(replays: Sequence[Replay]) -> tuple[Figure, ...]:
    """Load loops of the fastest run, and the loads' residuals over stroke rate, stroke and load."""
    rates = [r.stroke_rate for r in replays]
    strokes = [{end: 1e3 * r.stroke[end] for end in ENDS} for r in replays]
    loads = [{end: r.outputs[f"{end}_load"] for end in ENDS} for r in replays]
    return (
        _loops(max(replays, key=lambda r: r.pace)),
        Figure(
            "over_rate",
            "Load residual over stroke rate",
            "Measured minus simulated axle loads over the rate of the suspension's stroke. Good: a level band as high "
            "as the load cells' noise. Bad: a V or a bend (dampers that differ in rebound and compression), a step at "
            "zero (dry friction), a fan that opens to both sides (wrong position of the bump).",
            "stroke rate in m/s, rebound positive",
            "measured minus simulated load in N",
            _residuals(replays, rates),
        ),
        Figure(
            "over_stroke",
            "Load residual over stroke",
            "Measured minus simulated axle loads over the suspension's stroke. Good: a level band. Bad: a bend at "
            "the ends (progressive springs, bump stops), two levels (dry friction).",
            "stroke in mm, extension positive",
            "measured minus simulated load in N",
            _residuals(replays, strokes),
        ),
        Figure(
            "over_load",
            "Load residual over load",
            "Measured minus simulated axle loads over the simulated load, which deflects the tires. Good: a level "
            "band, as high at zero load as elsewhere. Bad: a bend (progressive tires), points far above zero at zero "
            "load (a wheel that does not leave the road: check the bump's height), a slope (gain of the load cells).",
            "simulated axle load in N",
            "measured minus simulated load in N",
            _residuals(replays, loads),
        ),
    )


def _loops(r: Replay) -> Figure:
    series = []
    for end in ENDS:
        load, stroke = f"{end}_load", 1e3 * r.stroke[end]
        x, y = _evenly_along(stroke, r.outputs[load])
        series.append(Series(f"{end}, measured", stroke, r.measured[load], "points"))
        series.append(Series(f"{end}, simulated", x, y, role="simulated"))
    caption = (
        f"Axle load over the suspension's simulated stroke in the fastest run ({PurePath(r.run).stem}); zero load is "
        "a wheel off the ground. Good: the points follow the loops. Bad: points outside or inside the loops (wrong "
        "damping), or off them at one end of the stroke (bump stop, progressive spring)."
    )
    stroke_label = "stroke in mm, extension positive"
    return Figure("loops", "Load over suspension stroke", caption, stroke_label, "axle load in N", tuple(series))


def _evenly_along(x: Array, y: Array) -> tuple[Array, Array]:
    """The line resampled in equal steps along it: in equal steps of time most points lie where the car is at rest."""
    steps = np.hypot(np.diff(x) / max(float(np.ptp(x)), 1e-12), np.diff(y) / max(float(np.ptp(y)), 1e-12))
    length = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, length[-1], LINE)
    return np.interp(even, length, x), np.interp(even, length, y)


def _residuals(replays: Sequence[Replay], over: Sequence[Mapping[str, Array]]) -> tuple[Series, ...]:
    """Load residuals of both axles over the quantity ``over``, all runs together."""
    return tuple(
        Series(
            f"{end} axle",
            np.concatenate([x[end] for x in over]),
            np.concatenate([r.residual(f"{end}_load") for r in replays]),
            "points",
            role="residual" if end == "front" else "accent",
        )
        for end in ENDS
    )
