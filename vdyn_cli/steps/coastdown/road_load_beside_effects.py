"""The road load beside candidate effects: a regression whose noise sizes are free of their signals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.inference import Regression, Unknown, approach
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restricted_likelihood import find_sizes, typical_sizes
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.noise import LARGEST_GUST, noise_of, wind_variance
from vdyn_cli.steps.coastdown.road_load_fit import ROUNDS
from vdyn_cli.steps.coastdown.road_load_regression import (
    STEPS,
    initial_regression,
    prior_information,
    rows_of,
    starting_at,
    weighted_start,
    with_hill_prior,
)
from vdyn_cli.steps.coastdown.road_load_rows import ROUGHNESS, RoadLoadRows

NEAR = 0.1  # share by which the baseline's unknowns move beside all candidates, which describe larger changes
SIZES_SETTLED = 0.05  # of the logarithm of a noise size
IMPLAUSIBLE = 1e-3  # probability of a rougher road, below which a road is not one of the roughness shown


def regression_with_effects(
    campaign: Campaign,
    effects: Sequence[Correction],
    extra: Sequence[Unknown],
    rounds: int = ROUNDS,
    base: Regression | None = None,
) -> Regression:
    """The regression at the baseline's fit with candidate effects beside it, and noise sizes free of their signals.

    The noise sizes come from the residual of a fit with baseline and all effects in, held together by their priors:
    sizes from the baseline alone would absorb the effects. The effects' unknowns then start at zero again.

    That fit is about a level road with a random one beside it, whose roughness is what turns with the heading
    (``Campaign.shown_roughness``): on the road that the baseline found, every error of a scale imitates that road. The
    baseline's unknowns stay NEAR, and gusts act as on the baseline's car: else candidates take the place of the drag,
    and gusts of any size are free. Where the baseline's road is not one of that roughness, it holds what the baseline
    lacks, and the runs are linearized about the road beside all candidates.

    Parameters
    ----------
    effects, extra, rounds : as in ``fit_road_load``.
    base : the campaign's ``weighted_start``, where that is at hand; it does not depend on the roughness shown.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    regression = initial_regression(replace(campaign, level_mean=True), effects, extra)
    base = weighted_start(campaign) if base is None else base
    largest = _largest(campaign)
    if any(rows_of(base).sizes.get(n, 0.0) > size for n, size in largest.items()):
        base = weighted_start(campaign, most=largest)
    if campaign.white:
        return starting_at(regression, {u.name: u.start for u in base.shared}, base.run_starts)
    known, at = rows_of(base), rows_of(base).at
    sizes = {**rows_of(regression).sizes, **typical_sizes(noise_of(campaign, 0, at))}
    values = {u.name: u.start for u in base.shared}
    if campaign.shown_roughness is not None and ROUGHNESS in sizes:
        sizes[ROUGHNESS] = max(campaign.shown_roughness, campaign.roughness or 0.0)
        values |= _road_values(rows_of(regression), known, sizes[ROUGHNESS])
    level = replace(regression, rows=rows_of(regression).weighted(sizes, at))
    level = with_hill_prior(starting_at(_near(level, values), values, base.run_starts))

    def resize(before: Regression) -> tuple[Regression, float]:
        after = _resized(before, *approach(before, STEPS))
        old, new = rows_of(before).sizes, rows_of(after).sizes
        return after, max(abs(float(np.log(new[n] / old[n]))) for n in new)

    settled = until_settled(resize, level, rounds, SIZES_SETTLED).state
    sized, starts = rows_of(settled), {u.name: u.start for u in settled.shared}
    road = np.array([values[n] for n in sized.road])
    if chdtrc(road.size, float(road @ road)) < IMPLAUSIBLE:
        values |= {n: starts[n] for n in sized.road}
    return with_hill_prior(starting_at(replace(regression, rows=sized.on_road(values)), values, base.run_starts))


def _road_values(rows: RoadLoadRows, known: RoadLoadRows, roughness: float) -> dict[str, float]:
    """The unknowns of the road of some rows, in units of a roughness, nearest to the road of other rows."""
    layout, other = rows.campaign.layout, known.campaign.layout
    if layout is None or other is None or known.center is None:
        return {}
    found = layout.coordinates(other.factor @ known.center) / roughness
    return dict(zip(rows.road, found.tolist(), strict=True))


def _near(regression: Regression, values: Mapping[str, float]) -> Regression:
    """The regression whose unknowns without a prior get one about these values."""

    def near(unknown: Unknown) -> Unknown:
        at = values.get(unknown.name, 0.0)
        return replace(unknown, prior=(at, NEAR * abs(at))) if unknown.prior is None and at else unknown

    return replace(regression, unknowns=tuple(near(u) for u in regression.unknowns))


def _resized(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The regression started at these values, with the noise sizes that its residuals there show.

    The road keeps the roughness that it showed, and the car its response to the noise.
    """
    rows, random, held = rows_of(regression), rows_of(regression).random(), {}
    regression = starting_at(regression, shared, own)
    start = regression.start()
    runs = [rows.noisy(k, regression.local(start, k), rows.at) for k in range(len(regression.runs))]
    if random is not None and rows.campaign.shown_roughness is not None:
        held = {ROUGHNESS: rows.sizes[ROUGHNESS]}
        random = replace(random, least=held[ROUGHNESS])
    sizes = find_sizes(
        runs, rows.sizes, prior_information(regression), random, most={**_largest(rows.campaign), **held}
    )
    return replace(regression, rows=rows.weighted(sizes, {**rows.at, "wind_variance": wind_variance(sizes)}))


def _largest(campaign: Campaign) -> dict[str, float]:
    """Largest noise of a source: of coasts, gusts beyond what weather allows are a force that the model misses.

    For the diagnosis. The fit that is published keeps noise of any size: what is missed then counts as noise.

    Beside an accelerometer that feels the road, gusts hold what it does not.
    """
    return {"gust": LARGEST_GUST} if campaign.drive == "coasting" and campaign.accelerometer == "none" else {}
