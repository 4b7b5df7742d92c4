"""The figures of a coast-down."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.result import Comparison, Figure, Series
from vdyn_cli.steps.coastdown.campaign_checks.coast_times import CoastTimes
from vdyn_cli.steps.coastdown.doubts.agreement import LocalForces
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad
from vdyn_cli.steps.coastdown.fit.residuals import by_speed, run_forces
from vdyn_cli.steps.coastdown.fit.road_load_fit import MAIN, RoadLoadFit

Role = Literal["measured", "accent", "muted"]

WAYS: tuple[tuple[float, str, Role], ...] = ((1.0, "out", "measured"), (-1.0, "back", "accent"), (0.0, "all", "muted"))
ELLIPSE = 2.447746830680816  # radius of the 95 % region in two dimensions, standard deviations


def comparisons(fit: RoadLoadFit) -> tuple[Comparison, ...]:
    """Speed (or specific force, in bins) of every run, measured and simulated."""
    found = []
    for k, run in enumerate(fit.campaign.runs):
        seen = fit.simulate(k)
        if fit.campaign.speed_fitted:
            since, measured, simulated = run.time - run.time[0], run.speed, seen.outputs["speed"]
            found.append(Comparison(run.name, "speed", "m/s", since, "time in the run [s]", measured, simulated))
            continue
        bins = fit.campaign.bins[k]
        force, model = bins.mean(run.channel("acceleration")), bins.mean(seen.outputs["acceleration"])
        found.append(Comparison(run.name, "acceleration", "m/s^2", bins.time, "time of the log [s]", force, model))
    return tuple(found)


def figures(
    fit: RoadLoadFit, load: RoadLoad, times: Sequence[CoastTimes], local: LocalForces | None
) -> tuple[Figure, ...]:
    """The road load, its residuals over speed and over runs, and the joint region of the main parameters.

    Parameters
    ----------
    times : of pairs of coasts. local : forces by local decelerations.
    """
    made = (_agreement(fit, load, local), _residual_force(fit), _run_forces(fit), _ellipse(fit))
    return (_road_load(fit, load, times), *(f for f in made if f is not None))


def _road_load(fit: RoadLoadFit, load: RoadLoad, times: Sequence[CoastTimes]) -> Figure:
    series = _load(fit, load)
    if times:
        at, each = np.array([t.speed for t in times]), np.array([t.force(fit.inertia) for t in times])
        error = np.array([t.force_error(fit.inertia) for t in times])
        series.append(Series("from coast-down times", 3.6 * at, each, "points", error=error, role="measured"))
    return Figure(
        "road_load",
        "Road load",
        "Line and band: the fitted road load with its 95 % interval. Points, where there are pairs of runs: force from "
        "their coast-down times, with no model but inertia. Good: the points scatter about the line within their bars. "
        "Bad: they bend away from it at one end; then the law of force over speed is wrong, or a brake or the wind "
        "acted.",
        "speed [km/h]",
        "force [N]",
        tuple(series),
    )


def _agreement(fit: RoadLoadFit, load: RoadLoad, local: LocalForces | None) -> Figure | None:
    """Force from the measured decelerations and fitted road load, over speed."""
    if local is None:
        return None
    at, force, half = 3.6 * local.speed, local.measured, local.half
    return Figure(
        "agreement",
        "Force from local decelerations",
        "Points: inertia times the slope of the measured speed in classes of speed, mean of both directions, with "
        "the 95 % interval of runs and road. Line and band: the fitted road load. Good: the bars reach the band. "
        "Bad: they miss it at one end; then the noise model hides a force that all runs have.",
        "speed [km/h]",
        "force [N]",
        (*_load(fit, load), Series("from decelerations", at, force, "points", error=half, role="measured")),
    )


def _load(fit: RoadLoadFit, load: RoadLoad) -> list[Series]:
    """The fitted road load over the speeds of the runs, with its 95 % band."""
    speed = np.linspace(*fit.speeds, 60)
    force, (low, high) = np.asarray(load.force(speed)), load.interval(speed)
    return [
        Series("95 % band", 3.6 * speed, low, "band", high, role="muted"),
        Series("fitted", 3.6 * speed, force, role="simulated"),
    ]


def _residual_force(fit: RoadLoadFit) -> Figure | None:
    """Residual force over speed, separately for each direction."""
    series = []
    for way, which, role in _by_direction(fit):
        if which.size >= 2:
            left = by_speed(fit, which.tolist())
            series.append(Series(way, 3.6 * left.speed, left.force, "points", error=2 * left.error, role=role))
    if not series:
        return None
    return Figure(
        "left_over",
        "Residual force at each speed",
        "Resistance of the runs beyond the fitted road load, mean and two standard errors over the runs. Good: all "
        "about zero. Out and back differ by a constant: the road slopes. They differ more at speed: a steady wind. "
        "Both bend alike: the law of force over speed is wrong.",
        "speed [km/h]",
        "force [N]",
        tuple(series),
    )


def _run_forces(fit: RoadLoadFit) -> Figure:
    force, error = run_forces(fit)
    series = [
        Series(way, 1.0 + which.astype(np.float64), force[which], "points", error=2 * error[which], role=role)
        for way, which, role in _by_direction(fit)
    ]
    return Figure(
        "runs",
        "Residual force of each run",
        "Resistance of each run beyond the common road load, with two standard deviations. Good: random scatter "
        "about zero. A fall from run to run: tires warm up. Out above and back below, or the reverse: slope or "
        "wind. One far from the others: inspect that run.",
        "run",
        "force [N]",
        tuple(series),
    )


def _by_direction(fit: RoadLoadFit) -> list[tuple[str, NDArray[np.intp], Role]]:
    """Label, indices of the runs and color role of each direction."""
    found = [(way, np.flatnonzero(fit.campaign.headings == heading), role) for heading, way, role in WAYS]
    return [one for one in found if one[1].size]


def _ellipse(fit: RoadLoadFit) -> Figure | None:
    """The joint 95 % region of rolling resistance and drag area."""
    solution = fit.solution
    if not set(MAIN) <= set(solution.names):
        return None
    at = [solution.names.index(n) for n in MAIN]
    spread = np.linalg.cholesky(solution.covariance[np.ix_(at, at)])
    turn = np.linspace(0, 2 * np.pi, 90)
    edge = ELLIPSE * spread @ np.array([np.cos(turn), np.sin(turn)])
    center = np.array([solution.values[n] for n in MAIN])
    return Figure(
        "ellipse",
        "Rolling resistance against drag area",
        "The joint 95 % region. Round: the runs separate both. Thin and slanted: they are collinear; coasts from "
        "higher down to lower speed make it round.",
        "rolling resistance",
        "drag area [m^2]",
        (
            Series("95 % region", center[0] + edge[0], center[1] + edge[1], role="simulated"),
            Series("estimate", center[:1], center[1:], "points", role="accent"),
        ),
    )
