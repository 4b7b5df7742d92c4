"""The road load with candidate effects: a regression whose estimated noise does not absorb the effects' signals."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
from scipy.special import chdtrc

from vdyn_cli.inference import Regression, Unknown, approach
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restricted_likelihood import find_sizes, typical_sizes
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_fit import NOISE_ROUNDS
from vdyn_cli.steps.coastdown.fit.road_load_regression import (
    PRELIMINARY_STEPS,
    initial_regression,
    noisy_runs,
    prior_information,
    rows_of,
    starting_at,
    weighted_start,
    with_hill_prior,
)
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS, RoadLoadRows
from vdyn_cli.steps.coastdown.noise import LARGEST_GUST, noise_of, wind_variance

NEAR = 0.1  # relative prior std of the baseline's unknowns besides the candidates, which describe larger changes
SIZES_SETTLED = 0.05  # largest change of the logarithm of a noise amplitude in a settled round
IMPLAUSIBLE = 1e-3  # p value below which the baseline's road does not have the shown roughness


def regression_with_effects(campaign: Campaign, added: AddedEffects, base: Regression | None) -> Regression:
    """The regression at the baseline's fit with candidate effects, and noise that does not absorb their signals.

    The noise amplitudes are estimated from the residuals of a fit of the baseline with all effects, regularized by
    their priors, because amplitudes from the baseline alone would absorb the effects. The effects' unknowns then start
    at zero again.

    That fit has a random road about a level one, with the roughness of the slope that changes sign with the heading
    (``Campaign.shown_roughness``), because every scale error imitates the road that the baseline estimated. Priors keep
    the baseline's unknowns NEAR their values, and gusts act as on the baseline's car; otherwise candidates could
    replace the drag, and the amplitude of gusts would be undetermined. Where the baseline's road does not have that
    roughness, it contains the baseline's model error, and the runs are linearized about the road of the joint fit.

    Parameters
    ----------
    base : the campaign's ``weighted_start``, if known; it does not depend on ``shown_roughness``.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    regression = initial_regression(replace(campaign, zero_mean_slope=True), added)
    base = weighted_start(campaign) if base is None else base
    largest = _largest(campaign)
    if any(rows_of(base).noise.sizes.get(n, 0.0) > size for n, size in largest.items()):
        base = weighted_start(campaign, most=largest)
    if campaign.white:
        return starting_at(regression, {u.name: u.start for u in base.shared}, base.run_starts)
    known, at = rows_of(base), rows_of(base).noise.at
    sizes = {**rows_of(regression).noise.sizes, **typical_sizes(noise_of(campaign, 0, at))}
    values = {u.name: u.start for u in base.shared}
    if campaign.shown_roughness is not None and ROUGHNESS in sizes:
        sizes[ROUGHNESS] = max(campaign.shown_roughness, campaign.roughness or 0.0)
        values |= _road_values(rows_of(regression), known, sizes[ROUGHNESS])
    level = replace(regression, rows=rows_of(regression).weighted(sizes, at))
    level = with_hill_prior(starting_at(_near(level, values), values, base.run_starts))

    def resize(before: Regression) -> tuple[Regression, float]:
        after = _resized(before, *approach(before, PRELIMINARY_STEPS))
        old, new = rows_of(before).noise.sizes, rows_of(after).noise.sizes
        return after, max(abs(float(np.log(new[n] / old[n]))) for n in new)

    settled = until_settled(resize, level, NOISE_ROUNDS, SIZES_SETTLED).state
    sized, starts = rows_of(settled), {u.name: u.start for u in settled.shared}
    road = np.array([values[n] for n in sized.road])
    if chdtrc(road.size, float(road @ road)) < IMPLAUSIBLE:
        values |= {n: starts[n] for n in sized.road}
    return with_hill_prior(starting_at(replace(regression, rows=sized.on_road(values)), values, base.run_starts))


def _road_values(rows: RoadLoadRows, known: RoadLoadRows, roughness: float) -> dict[str, float]:
    """Values of the road's unknowns in ``rows``, in units of ``roughness``, closest to the road of ``known``."""
    layout, other = rows.campaign.layout, known.campaign.layout
    if layout is None or other is None or known.center is None:
        return {}
    found = layout.coordinates(other.factor @ known.center) / roughness
    return dict(zip(rows.road, found.tolist(), strict=True))


def _near(regression: Regression, values: Mapping[str, float]) -> Regression:
    """The regression with a prior about these values for every unknown that has none."""

    def near(unknown: Unknown) -> Unknown:
        at = values.get(unknown.name, 0.0)
        return replace(unknown, prior=(at, NEAR * abs(at))) if unknown.prior is None and at else unknown

    return regression.changed(near)


def _resized(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The regression started at these values, with the noise amplitudes estimated from its residuals there.

    The road keeps its shown roughness, and the car its response to the noise.
    """
    rows, random, held = rows_of(regression), rows_of(regression).random(), {}
    regression = starting_at(regression, shared, own)
    if random is not None and rows.campaign.shown_roughness is not None:
        held = {ROUGHNESS: rows.noise.sizes[ROUGHNESS]}
        random = replace(random, least=held[ROUGHNESS])
    most = {**_largest(rows.campaign), **held}
    sizes = find_sizes(noisy_runs(regression), rows.noise.sizes, prior_information(regression), random, most=most)
    return replace(regression, rows=rows.weighted(sizes, {**rows.noise.at, "wind_variance": wind_variance(sizes)}))


def _largest(campaign: Campaign) -> dict[str, float]:
    """Upper limits of noise amplitudes, by source: stronger gusts than weather allows are a force the model lacks.

    Only for the diagnosis of coasts without an accelerometer. The published fit has no limit, so that a model error
    counts as noise there.
    """
    return {"gust": LARGEST_GUST} if campaign.coasting and campaign.accelerometer == "none" else {}
