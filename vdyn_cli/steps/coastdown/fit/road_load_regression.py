"""The road load as a regression: its unknowns, start values, and the noise amplitudes estimated from its residuals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from vdyn_cli.effects import Effect
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.inference import Regression, Unknown, approach
from vdyn_cli.inference.bins import Bins
from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, typical_sizes
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS, START, SUBSTEPS, RoadLoadRows, RowNoise
from vdyn_cli.steps.coastdown.fit.road_run import RoadRun
from vdyn_cli.steps.coastdown.fit.simulated_runs import SimulatedRuns
from vdyn_cli.steps.coastdown.noise import noise_of, wind_variance
from vdyn_cli.steps.coastdown.road.shared_road import (
    MEAN_SLOPE,
    WHOLE_ROAD,
    independent_slopes,
    road_unknowns,
)
from vdyn_cli.steps.contract import NO_VALUES

PRELIMINARY_STEPS = 6  # of a preliminary fit, whose values are not published
STRIDE = 2  # bins over which a deceleration is computed: one bin would double the noise
INSIDE = 0.01  # share of the physical range that a start keeps from its bounds


def with_noise_of(known: Regression, added: AddedEffects) -> Regression:
    """A regression with other effects, and the road, noise amplitudes and start values of a known one.

    Parameters
    ----------
    known : regression of the same campaign.
    """
    base = rows_of(known)
    regression = _at_center(initial_regression(base.campaign, added), base)
    return starting_at(with_hill_prior(regression), {u.name: u.start for u in known.shared}, dict(known.run_starts))


def _at_center(regression: Regression, base: RoadLoadRows) -> Regression:
    """The regression with the road and the noise amplitudes of the baseline's rows."""
    rows = rows_of(regression)
    rows = replace(rows, center=base.center, runs=replace(rows.runs, drives=base.runs.drives))
    return replace(regression, rows=rows.weighted(base.noise.sizes, base.noise.at))


def weighted_start(
    campaign: Campaign, near: Regression | None = None, most: Mapping[str, float] = NO_VALUES
) -> Regression:
    """The baseline's regression after a few steps, with the noise amplitudes estimated from its residuals.

    Parameters
    ----------
    near : the ``weighted_start`` of the same runs on a slightly different road; from there one round is enough.
    most : upper limits of noise amplitudes, by source.

    Raises
    ------
    ResultError : the model has no finite value at the start.
    """
    regression = initial_regression(campaign)
    if near is not None:
        sizes, at = rows_of(near).noise.sizes, rows_of(near).noise.at
        begin = {u.name: u.start for u in near.shared if u.name not in set(rows_of(near).road)}
        regression = replace(regression, rows=rows_of(regression).weighted(sizes, at))
        regression = starting_at(with_hill_prior(regression), begin, near.run_starts)
    for _ in range(2 if near is None else 1):
        regression = reweighted(regression, *approach(regression, PRELIMINARY_STEPS), most)
    return regression


def rows_of(regression: Regression) -> RoadLoadRows:
    """The rows of a road load's regression, with their type."""
    assert isinstance(regression.rows, RoadLoadRows)
    return regression.rows


def effects_of(regression: Regression) -> tuple[Effect, ...]:
    """The effects in the model of a road load's regression."""
    return tuple(e for e in rows_of(regression).runs.simulator.effects if isinstance(e, Effect))


def transferred(regression: Regression, campaign: Campaign, values: Mapping[str, float]) -> Regression:
    """The regression of other runs of the same car, with the same unknowns, effects and noise amplitudes.

    Parameters
    ----------
    regression : of the runs that were driven. campaign : the other runs, of the same model.
    values : of the shared unknowns, which determine the car's response to the noise.
    """
    rows = rows_of(regression)
    at = {n: values.get(n, v) for n, v in campaign.values.items()} | {"wind_variance": rows.noise.at["wind_variance"]}
    starts = {START: np.array([r.speed[0] for r in campaign.runs])} if campaign.speed_fitted else {}
    runs = tuple(r.name for r in campaign.runs)
    level = None if rows.center is None else np.zeros_like(rows.center)
    there = replace(rows, runs=SimulatedRuns(campaign, rows.runs.simulator), center=level).weighted(
        rows.noise.sizes, at
    )
    origins = tuple(r.origin for r in campaign.runs)
    return replace(regression, runs=runs, rows=there, run_starts=starts, origins=origins)


def initial_regression(campaign: Campaign, added: AddedEffects = NO_EFFECTS) -> Regression:
    """The regression with typical noise amplitudes, started at estimates from the decelerations.

    Its shared unknowns are those of the campaign, the slopes of the shared road, and those of the effects; each run's
    own unknown is its start speed.
    """
    campaign = replace(  # whose random road leaves out what the effects describe: all of it, or its mean slope
        campaign,
        flat_road=campaign.flat_road or WHOLE_ROAD in added.covered,
        zero_mean_slope=campaign.zero_mean_slope or MEAN_SLOPE in added.covered,
    )
    layout, hills = campaign.layout, _described_slopes(campaign, added)
    road = () if layout is None else road_unknowns(layout)
    unknowns = (*_with_start_values(campaign), *road, *added.unknowns)
    of_road = tuple(u.name for u in road)
    simulator = Simulator(
        campaign.model,
        campaign.values,
        unknowns=(*(u.name for u in unknowns if u.name not in of_road), START, "wind_variance"),
        effects=added.effects,
        substeps=1 if campaign.nodes is None else SUBSTEPS,
    )
    simulation, level = SimulatedRuns(campaign, simulator), np.zeros(len(road)) if road else None
    rows = RoadLoadRows(simulation, tuple(u.name for u in unknowns), RowNoise({}, {}), of_road, level, hills)
    sizes = typical_sizes(noise_of(campaign, 0, campaign.values))
    if (hills or road) and not campaign.white:
        sizes[ROUGHNESS] = max(SOURCES[ROUGHNESS].typical, campaign.roughness or 0.0)
    starts: dict[str, Array] = {}
    if campaign.speed_fitted:
        unknowns = (*unknowns, Unknown(START, 15.0, -5.0, 160.0, "m/s", per_run=True, nuisance=True))
        starts = {START: np.array([r.speed[: min(5, r.speed.size)].mean() for r in campaign.runs])}
    names, origins = tuple(r.name for r in campaign.runs), tuple(r.origin for r in campaign.runs)
    return with_hill_prior(Regression(unknowns, names, rows.weighted(sizes, campaign.values), starts, origins=origins))


def _with_start_values(campaign: Campaign) -> tuple[Unknown, ...]:
    """The campaign's unknowns, with a least-squares fit of the decelerations as start of those of the road load.

    (M + mr) V' = F - frr M g - frr1 M g V - 1/2 rho Cd A (V + w)|V + w|

    Far from the solution the simulated car may stop, and a standing car is not sensitive to the road load.

    Assumes that the mean of a bin represents its samples. Returns ``campaign.unknowns`` with too few bins.
    """
    at = campaign.values
    parts = [_decelerations(campaign, run, bins) for run, bins in zip(campaign.runs, campaign.bins, strict=True)]
    speed, wind, force = (np.concatenate(column) for column in zip(*parts, strict=True))
    flow = speed + wind
    columns = {
        "rolling_resistance": np.full(speed.size, at["mass"] * GRAVITY),
        "rolling_speed": speed * at["mass"] * GRAVITY,
        "drag_area": 0.5 * at["air_density"] * flow * np.abs(flow),
    }
    estimated = [u.name for u in campaign.unknowns if u.name in columns]
    if not estimated or speed.size < 2 * len(estimated):
        return campaign.unknowns
    for name in set(columns) - set(estimated):
        force = force - at[name] * columns[name]
    line = np.linalg.lstsq(np.column_stack([columns[n] for n in estimated]), force, rcond=None)[0]
    found = dict(zip(estimated, line.tolist(), strict=True))
    return tuple(_moved(u, found[u.name]) if u.name in found else u for u in campaign.unknowns)


def _moved(unknown: Unknown, start: float) -> Unknown:
    margin = INSIDE * (unknown.upper - unknown.lower)
    return replace(unknown, start=float(np.clip(start, unknown.lower + margin, unknown.upper - margin)))


def _decelerations(campaign: Campaign, run: RoadRun, bins: Bins) -> tuple[Array, Array, Array]:
    """Speed, headwind and decelerating force between bins, (k,) m/s, m/s, N."""
    at, zeros = campaign.values, np.zeros(run.time.size)
    if "drive_torque" in run.inputs:
        drive = run.inputs["drive_torque"] * (at["driveline_efficiency"] * at["gear_ratio"] / at["wheel_radius"])
    else:
        drive = run.inputs.get("drive_force", 0.0)
    pushed = zeros + drive - at["mass"] * GRAVITY * run.inputs["grade"]
    means = bins.mean(np.column_stack([run.speed, zeros + run.inputs["wind_speed"], pushed]))
    part = run.part[bins.first]
    within = part[STRIDE:] == part[:-STRIDE]
    rate = (means[STRIDE:, 0] - means[:-STRIDE, 0]) / (bins.time[STRIDE:] - bins.time[:-STRIDE])
    middle = 0.5 * (means[STRIDE:] + means[:-STRIDE])
    force = middle[:, 2] - (at["mass"] + at["rotating_mass"]) * rate
    return middle[within, 0], middle[within, 1], force[within]


def _described_slopes(campaign: Campaign, added: AddedEffects) -> tuple[str, ...]:
    """Names of the road's slopes that an effect describes; none where no noise or no speed depends on them."""
    if campaign.white or not campaign.speed_fitted:
        return ()
    slopes = tuple(n for e in added.effects if WHOLE_ROAD in e.covers for n in e.unknowns)
    return slopes if set(slopes) <= set(added.names) else ()


def with_hill_prior(regression: Regression) -> Regression:
    """The regression with the prior of a random road, of the noise's roughness, for slopes that an effect describes.

    Without it, a valley between the starts of both directions is collinear with a force that increases with speed.
    """
    rows = rows_of(regression)
    if not rows.hills:
        return regression
    correlation = rows.hill_factor @ rows.hill_factor.T
    degrees = independent_slopes(rows.hill_factor)
    related = {
        a: dict(zip(rows.hills, row.tolist(), strict=True)) for a, row in zip(rows.hills, correlation, strict=True)
    }

    def with_prior(u: Unknown) -> Unknown:
        u = replace(u, prior=(0.0, rows.noise.sizes[ROUGHNESS]), prior_degrees=degrees, prior_stated=False)
        return replace(u, prior_correlation=related[u.name])

    return regression.changed(with_prior, related)


def scaled_to_residuals(regression: Regression) -> Regression:
    """The regression with white noise as large as the residuals at the start, so that priors keep their weight."""
    rows, start, squares = rows_of(regression), regression.start(), []
    for k in range(len(regression.runs)):
        residual, _ = rows.binned(k, regression.local(start, k))
        squares.append((residual / rows.noise.factors[k]) ** 2)
    scale = max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1.0)
    return replace(
        regression, rows=rows.weighted({n: size * scale for n, size in rows.noise.sizes.items()}, rows.noise.at)
    )


def reweighted(
    regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array], most: Mapping[str, float] = NO_VALUES
) -> Regression:
    """The regression started at these values, whitened with the noise amplitudes estimated from its residuals there.

    Parameters
    ----------
    shared, own : values of the shared unknowns, and (runs,) of each run's own. most : upper limits of amplitudes.
    """
    rows = rows_of(regression)
    at = {**rows.noise.at, **shared}
    runs = []
    for k in range(len(rows.campaign.runs)):
        theta = np.array([*(shared[n] for n in rows.shared), *(own[u.name][k] for u in regression.own)])
        runs.append(rows.noisy(k, theta, at))
    sizes = find_sizes(runs, rows.noise.sizes, prior_information(regression), rows.random(), most=most)
    rows = rows.on_road(shared).weighted(sizes, {**at, "wind_variance": wind_variance(sizes)})
    if rows.road:  # the same slopes in units of another roughness
        shared = {**shared, **dict(zip(rows.road, rows.reference.tolist(), strict=True))}
    return with_hill_prior(replace(starting_at(regression, shared, own), rows=rows))


def noisy_runs(regression: Regression) -> list[NoisyRun]:
    """The runs at the regression's start, for the noise model."""
    rows, start = rows_of(regression), regression.start()
    return [rows.noisy(k, regression.local(start, k), rows.noise.at) for k in range(len(regression.runs))]


def prior_information(regression: Regression) -> Array:
    """Inverse prior variance (s,) of the shared unknowns, zero without a prior."""
    return np.array([1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in regression.shared])


def starting_at(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The regression with these start values; other unknowns keep theirs.

    Parameters
    ----------
    shared, own : values of some shared unknowns, and (runs,) of the runs' own.
    """
    started = regression.changed(lambda u: replace(u, start=shared[u.name]), shared)
    return replace(started, run_starts={**regression.run_starts, **own})
