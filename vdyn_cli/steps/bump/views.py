"""What to show of bump crossings: loads measured and simulated, what is left over, how the car swings."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import PurePath

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Solution
from vdyn_cli.quantities.result import Comparison, Figure, Series, Table
from vdyn_cli.steps.bump.crossing import LOADS
from vdyn_cli.steps.bump.modes import Mode
from vdyn_cli.steps.bump.regression import BumpFit

Array = NDArray[np.float64]

UNITS = {"front_load": "N", "rear_load": "N", "vertical_acceleration": "m/s^2", "pitch_rate": "rad/s"}
ENDS = ("front", "rear")
LINE = 800  # points of a line that turns back on itself


@dataclass(frozen=True)
class Replay:
    """One run as simulated at the solution.

    Parameters
    ----------
    outputs : each channel (n,), the sensor's zero included. zeros : of each channel.
    stroke, stroke_rate : of each axle (n,), m and m/s, extension positive.
    distance : m, of the bump from the log's start. pace : m/s.
    """

    run: str
    time: Array
    measured: Mapping[str, Array]
    outputs: Mapping[str, Array]
    zeros: Mapping[str, float]
    stroke: Mapping[str, Array]
    stroke_rate: Mapping[str, Array]
    distance: float
    wheelbase: float
    pace: float

    def left(self, channel: str) -> Array:
        """Measured less simulated."""
        return self.measured[channel] - self.outputs[channel]

    def off_road(self, end: str, static: float) -> float:
        """Time for which an axle carries nothing, s."""
        load = self.outputs[f"{end}_load"] - self.zeros[f"{end}_load"]
        return float(np.sum(np.diff(self.time)[load[:-1] < 1e-3 * static]))

    def dissipated(self, end: str, damping: float) -> float:
        """Energy that an axle's dampers turn into heat, J: the integral of C v^2."""
        power = damping * self.stroke_rate[end] ** 2
        return float(np.sum(np.diff(self.time) * (power[1:] + power[:-1]) / 2))


def replay(fit: BumpFit, solution: Solution, run: int) -> Replay:
    """Simulate one run at the solution."""
    crossing, theta = fit.crossings[run], fit.local(solution, run)
    simulated = fit.simulate(run, theta, states=True)
    zeros = {n: float(solution.per_run[f"{n}_zero"][run]) for n in fit.channels}
    s, arms = simulated.states, fit.arms(solution.values)
    stroke = {e: s["heave"] + arms[e] * s["pitch"] - s[f"wheel_{e}"] for e in ENDS}
    rate = {e: s["heave_rate"] + arms[e] * s["pitch_rate"] - s[f"wheel_rate_{e}"] for e in ENDS}
    return Replay(
        crossing.run,
        crossing.time,
        {n: crossing.channels[n] for n in fit.channels},
        {n: simulated.outputs[n] + zeros[n] for n in fit.channels},
        zeros,
        stroke,
        rate,
        float(solution.per_run["distance_front"][run]),
        arms["front"] - arms["rear"],
        crossing.pace,
    )


def comparisons(replays: Sequence[Replay]) -> tuple[Comparison, ...]:
    return tuple(
        Comparison(r.run, n, UNITS[n], r.time, "time in s", measured, r.outputs[n], used=np.isfinite(measured))
        for r in replays
        for n, measured in r.measured.items()
    )


def figures(replays: Sequence[Replay]) -> tuple[Figure, ...]:
    fastest = max(replays, key=lambda r: r.pace)
    return (_loops(fastest), _over_rate(replays), _over_stroke(replays), _over_load(replays))


def _loops(r: Replay) -> Figure:
    series = []
    for end in ENDS:
        load = f"{end}_load"
        x, y = _along(1e3 * r.stroke[end], r.outputs[load])
        series.append(Series(f"{end}, measured", 1e3 * r.stroke[end], r.measured[load], "points"))
        series.append(Series(f"{end}, simulated", x, y, role="simulated"))
    caption = (
        f"Axle load over the suspension's simulated stroke in the fastest run ({PurePath(r.run).stem}); zero load is a "
        "wheel in the air. Good: the points follow the loops all the way round. Bad: points that turn outside or "
        "inside the loops (another damper), or leave them at one end of the stroke (bump stop, progressive spring)."
    )
    return Figure("loops", "Load over suspension stroke", caption, "stroke in mm, extension positive",
                  "axle load in N", tuple(series))  # fmt: skip


def _along(x: Array, y: Array) -> tuple[Array, Array]:
    """The same line with points in even steps along it: in time most of them lie where the car is at rest."""
    steps = np.hypot(np.diff(x) / max(float(np.ptp(x)), 1e-12), np.diff(y) / max(float(np.ptp(y)), 1e-12))
    way = np.concatenate([[0.0], np.cumsum(steps)])
    even = np.linspace(0.0, way[-1], LINE)
    return np.interp(even, way, x), np.interp(even, way, y)


def _left_over(
    key: str, title: str, caption: str, x_label: str, replays: Sequence[Replay], over: Callable[[Replay, str], Array]
) -> Figure:
    """What is left of the loads over something else, all runs together."""
    series = tuple(
        Series(
            f"{end} axle",
            np.concatenate([over(r, end) for r in replays]),
            np.concatenate([r.left(f"{end}_load") for r in replays]),
            "points",
            role="residual" if end == "front" else "accent",
        )
        for end in ENDS
    )
    return Figure(key, title, caption, x_label, "measured less simulated load in N", series)


def _over_rate(replays: Sequence[Replay]) -> Figure:
    caption = (
        "What the simulation leaves of the axle loads, over the speed of the suspension's stroke. Good: a level band "
        "as high as the load cells' noise. Bad: a V or a bend (dampers that differ in rebound and compression), a step "
        "at zero (dry friction), a fan that opens to both sides (timing of the bump)."
    )
    title, label = "Load left over, against stroke speed", "stroke rate in m/s, rebound positive"
    return _left_over("over_rate", title, caption, label, replays, lambda r, end: r.stroke_rate[end])


def _over_stroke(replays: Sequence[Replay]) -> Figure:
    caption = (
        "The same over the stroke. Good: a level band. Bad: a bend at the ends (progressive springs, bump stops), "
        "two levels (dry friction)."
    )
    title, label = "Load left over, against stroke", "stroke in mm, extension positive"
    return _left_over("over_stroke", title, caption, label, replays, lambda r, end: 1e3 * r.stroke[end])


def _over_load(replays: Sequence[Replay]) -> Figure:
    caption = (
        "The same over the simulated load, which bends the tires. Good: a level band, as high at zero load as "
        "elsewhere. Bad: a bend (tires that stiffen), points far above zero at zero load (a wheel that does not leave "
        "the road: check the bump's height), a slope (gain of the load cells)."
    )
    title, label = "Load left over, against load", "simulated axle load in N"
    return _left_over("over_load", title, caption, label, replays, lambda r, end: r.outputs[f"{end}_load"])


def crossing_table(replays: Sequence[Replay], static: Mapping[str, float], values: Mapping[str, float]) -> Table:
    """One row a run and axle: speed, place of the bump, and what the car went through."""
    rows = []
    for r in replays:
        for end in ENDS:
            load, stroke = f"{end}_load", 1e3 * r.stroke[end]
            row = (
                PurePath(r.run).stem,
                end,
                f"{3.6 * r.pace:.1f} km/h",
                f"{r.distance + (r.wheelbase if end == 'rear' else 0.0):.3f} m",
                f"{np.nanmax(r.outputs[load]) / 1e3:.1f} kN",
                f"{1e3 * r.off_road(end, static[load]):.0f} ms",
                f"{stroke.min():.0f} mm",
                f"{stroke.max():+.0f} mm",
                f"{r.dissipated(end, values[f'suspension_damping_{end}']):.0f} J",
            )
            rows.append(row)
    columns = (
        *("run", "axle", "speed", "meets the bump after", "largest load", "off the road"),
        *("compression", "extension", "into the dampers"),
    )
    caption = (
        "As simulated. Compression and extension are the suspension's largest from rest; energy is what an axle's "
        "dampers turn into heat from the first to the last fitted sample."
    )
    return Table("crossings", "The crossings", columns, tuple(rows), caption)


def mode_table(modes: Sequence[Mode]) -> Table:
    rows = tuple(
        (
            m.name,
            f"{m.frequency:.3f} Hz",
            f"{m.frequency95[0]:.3f} to {m.frequency95[1]:.3f}",
            f"{m.damping:.3f}",
            f"{m.damping95[0]:.3f} to {m.damping95[1]:.3f}",
        )
        for m in modes
    )
    columns = ("mode", "natural frequency", "95 %", "damping ratio", "95 %")
    caption = (
        "How the car swings with its tires on the ground, by the estimates. Usual cars: bounce and pitch at 1 to 2 Hz "
        "with 0.2 to 0.4 of critical damping, wheel hop at 9 to 15 Hz."
    )
    return Table("modes", "Natural frequencies and damping", columns, rows, caption)


def misfit_table(fit: BumpFit, misfit: Mapping[str, float]) -> Table:
    """Each channel's noise against what the simulation leaves of it."""
    rows = []
    for name in fit.channels:
        noise = float(np.sqrt(np.mean([c.noise[name] ** 2 for c in fit.crossings])))
        left = misfit[name] * fit.inflation[name] * noise
        rows.append((name, f"{noise:.3g} {UNITS[name]}", f"{left:.3g} {UNITS[name]}", f"{left / noise:.2f}"))
    columns = ("channel", "noise", "left over (rms)", "ratio")
    caption = (
        "A ratio of 1 means that the simulation follows the channel down to its noise; above 1.2 something is missing."
    )
    return Table("misfit", "How well each channel is followed", columns, tuple(rows), caption)


def load_rms(replays: Sequence[Replay]) -> float:
    """Root mean square of what is left of both loads, N."""
    left = np.concatenate([r.left(n) for r in replays for n in LOADS])
    return float(np.sqrt(np.nanmean(left**2)))
