"""The noise model of the slow rows: gusts, winds, uneven road and the torque sensor's noise, integrated by the car."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from vdyn_cli.inference.bins import Bins, cut
from vdyn_cli.inference.gust_covariance import Colored, RunNoise, SteadyComponent, White, integration
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, typical_sizes
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.fit.residual_rows import RowLayout
from vdyn_cli.steps.validate.road.road_slope import SENSED_SLOPE

SIZING = 1.0  # s, width of a bin to estimate the sizes: in wider bins a sensor's white noise looks like a rough road
DEPARTURE = 0.003  # m/s, uncertainty of the speed after leaving rest: brakes release, tires creep, friction breaks away
MOST_SIZED = 40  # largest number of segments from which the sizes are estimated


# Largest sizes of noise: gusts of a storm and, between drives, a change of wind, an unrecorded slope and a load of some
# percent of the mass. Larger ones are model errors: without limits, a gust of 200 m/s explains the torque of another
# drive, and whichever effect then fits best seems to suffice.
LARGEST_AMPLITUDES: Mapping[str, float] = {
    "gust": 4.0,
    "run_wind": 5.0,
    "run_drive": 0.05,
    "road": 0.02,
    "road_mean": 0.02,
}
# Of sensors: this multiple of the level by third differences or, if larger, these values (filters hide the noise).
SENSOR_RATIO, SPEED_NOISE, ACCELERATION_NOISE = 5.0, 0.3, 0.5  # the last two in m/s and m/s^2


def inertia_of(values: Mapping[str, float]) -> float:
    """Effective mass of the car including its rotating parts, kg, from the model's parameters (SI).

    M + mr of a mass on a road; M + (4 Jw + Jd) / r^2 of a vehicle, with wheels Jw, driveline Jd (kg m^2), radius r (m)
    """
    if "rotating_mass" in values:
        return values["mass"] + values["rotating_mass"]
    turning = 4 * values["wheel_inertia"] + values["driveline_inertia"]
    return values["mass"] + turning / values["wheel_radius"] ** 2


def slow_noise(
    s: DriveSegment, layout: RowLayout, bins: Bins, values: Mapping[str, float], torque_level: float
) -> RunNoise:
    """Covariance of the slow rows of a segment as a function of the sizes of its sources.

    A gust u changes the acceleration by -p u with p = rho cd A v / m, and the car integrates it with the decay rate p.

    Parameters
    ----------
    layout : the rows. bins : over which they are averaged. values : parameters of the model, SI.
    torque_level : N m, white noise of a sample of the drive torque.
    """
    inertia = inertia_of(values)
    speed = np.maximum(bins.mean(s.outputs["speed"][layout.keep] + s.inputs["wind_speed"][layout.keep]), 0.0)
    drag = values["air_density"] * values["drag_area"] * speed / inertia
    ratio = values.get("driveline_efficiency", 1.0) * values.get("gear_ratio", 1.0)  # 1 for torques at the half-shafts
    driven = ratio / values["wheel_radius"] / inertia * torque_level
    together = layout.section(bins)[:, None] == layout.section(bins)[None, :]
    spans = _with_unused_motion(s, layout, bins)
    moved, here = integration(spans, drag) * together, np.eye(bins.time.size)
    spacing = float(np.median(np.diff(s.time)))
    pushed = moved * driven * np.sqrt(spacing / np.maximum(spans.width, spacing))  # by the torque sensor, since a rest
    walk = pushed @ pushed.T
    walk += DEPARTURE**2 * together * (layout.section(bins) > 0)  # after a rest
    count = bins.count.astype(float)
    level = layout.common_level
    share = values["mass"] / inertia
    if s.slope_error is not None:
        climbed = -GRAVITY * share * moved @ bins.mean(s.slope_error[layout.keep])
        walk += climbed @ climbed.T
    if not layout.force:
        gust = -moved * drag
        parts: list[White | SteadyComponent | Colored] = [
            White("speed_noise", level**2 / count),
            Colored("gust", "gust_time", gust, bins.lags),
            SteadyComponent("run_wind", gust.sum(axis=1)),
            SteadyComponent("run_drive", moved.sum(axis=1)),
        ]
        if SENSED_SLOPE in s.inputs:
            # Errors of a slope from an accelerometer and of an estimated torque are correlated over time.
            parts.append(Colored("push", "push_time", moved, bins.lags))
        else:
            parts.append(Colored("road", "road_time", -GRAVITY * share * moved, bins.lags))
        return RunNoise(tuple(parts), walk, moved.sum(axis=1))
    direct = here - drag[:, None] * moved
    push, none = np.vstack([moved, direct]), np.zeros(count.size)
    gust = -push * drag
    road = -GRAVITY * np.vstack([share * moved, share * direct - here])
    lag = bins.lags
    force = layout.levels["acceleration"]
    parts = [
        White("speed_noise", np.r_[level**2 / count, none]),
        White("acceleration_noise", np.r_[none, (force**2 + driven**2) / count]),
        Colored("gust", "gust_time", gust, lag),
        Colored("road", "road_time", road, lag),
        SteadyComponent("road_mean", road.sum(axis=1)),
        SteadyComponent("run_wind", gust.sum(axis=1)),
        SteadyComponent("run_drive", push.sum(axis=1)),
    ]
    known = np.zeros((2 * count.size, 2 * count.size))
    known[: count.size, : count.size] = walk
    return RunNoise(tuple(parts), known, push.sum(axis=1))


def _with_unused_motion(s: DriveSegment, layout: RowLayout, bins: Bins) -> Bins:
    """The bins that begin where the bin before ends, or where the car was last at rest or the segment starts.

    Rows of a slow car are not used, but slopes and torques move it there, too: a launch takes two seconds to reach
    the first row, in which an error of the slope by 0.3 % changes the speed by 0.06 m/s.
    """
    begin = layout.time[bins.first]
    before = np.r_[s.time[0], (begin + bins.width)[:-1]]
    rests = np.r_[-np.inf, layout.rests]
    unused = np.maximum(begin - np.maximum(before, rests[np.searchsorted(layout.rests, begin)]), 0.0)
    return replace(bins, width=bins.width + unused, lead=bins.lead + unused)


def sizing_bins(layout: RowLayout) -> Bins:
    """Wider bins to estimate the sizes at lower cost; never narrower than those of the fitted rows."""
    width = layout.bins.width
    return cut(layout.time, max(SIZING, float(np.median(width)), float(np.sum(width)) / 100), layout.part)


def sizes(runs: Sequence[NoisyRun], priors: Array, layouts: Sequence[RowLayout]) -> dict[str, float]:
    """Sizes of all noise sources from the slow rows of the segments, by restricted maximum likelihood.

    Parameters
    ----------
    runs : slow rows with their Jacobians. priors : (s,) prior information about the shared unknowns.
    layouts : of the rows of each segment.
    """
    step = max(1, -(-len(runs) // MOST_SIZED))
    some = runs[::step]
    return find_sizes(some, typical_sizes(some[0].noise), priors, most=_largest(layouts))


def _largest(layouts: Sequence[RowLayout]) -> dict[str, float]:
    """The largest plausible size of every source; those of sensors as multiples of their levels."""
    speed = float(np.median([one.common_level for one in layouts]))
    found = {**LARGEST_AMPLITUDES, "speed_noise": max(SENSOR_RATIO, SPEED_NOISE / speed)}
    if any(one.force for one in layouts):
        force = float(np.median([one.levels["acceleration"] for one in layouts if one.force]))
        found["acceleration_noise"] = max(SENSOR_RATIO, ACCELERATION_NOISE / force)
    return found
