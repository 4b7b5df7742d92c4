"""Search for the road that the runs share: its spectrum, the overlap of both directions, and each run's place on it.

All maximize the restricted likelihood of the runs together, before the published fit.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, likelihoods_of
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_regression import (
    noisy_runs,
    prior_information,
    rows_of,
    weighted_start,
)
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS, RoadLoadRows
from vdyn_cli.steps.coastdown.noise import binned_slopes, force_response, slope_response
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY
from vdyn_cli.steps.coastdown.road.shared_road import DEFAULT_SPECTRUM, possible_turns
from vdyn_cli.steps.road_spectrum import SPECTRA

ABOUT = 1.0  # of the log likelihood: the difference that chance makes for each further parameter (Akaike)
LEVEL = 1e-3  # scale of the roughness that stands for a level road
SCALES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of the roughness at which spectra are compared
PLACE = 30.0  # m, standard deviation between places at which runs of one direction begin: a tester aims at a mark
SHIFT_STEP = 10.0  # m over which the change of slope is differenced: half the distance of the road's knots
HATS, POWERS = 24, 4  # hat functions of a free resistance, one every 60 m or more; powers of a cubic, for a wind
ANY_FORCE = 0.02  # of the weight: prior standard deviation of such forces, twice a car's rolling resistance
NEARBY = 2  # steps of ``possible_turns`` to either side that are one distance, 4 % of it: refined afterwards
NEVER = 1e-3  # probability of a distance that is left out
REFINED, NEIGHBORS = (15.0, 5.0), 4  # m, grid steps of the distance between the starts, and steps to either side


@dataclass(frozen=True)
class LocatedCampaign:
    """A campaign with its road, and the baseline's ``weighted_start`` on that road; None where no road is shared."""

    campaign: Campaign
    base: Regression | None = None


def located(campaign: Campaign) -> LocatedCampaign:
    """The campaign on the most likely road, with the roughness of the slope that changes sign with the heading.

    An error of the speed that lasts for seconds enters its noise where the runs show one.

    Where position is not logged, the distance between the starts of both directions is unknown, about the length of a
    run; the most likely one is used if the runs show it. Else each direction keeps a profile, and both are correlated
    as over all possible distances.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    campaign = _with_filtered_speed(campaign)
    if campaign.layout is None:
        return LocatedCampaign(campaign)
    likelihood = _likelihood(campaign)
    found, scale = _with_spectrum(likelihood, campaign)
    if campaign.road is None and set(campaign.headings) == {1.0, -1.0}:
        found, scale = _turned(likelihood, found, scale)
    if campaign.road is None and scale:
        for step in REFINED:
            found = _shifted(_finely_turned(likelihood, found, scale, step), likelihood.regression)
    base = weighted_start(found)  # from typical noise: that of the road before may hold a local maximum
    if found.filtered and not _shows_filtered_speed(base):  # what looked like it before was the road
        found = replace(found, filtered=False)
        base = weighted_start(found)
    shown = min(_likelihood(found, hats, base).roughness() for hats in (HATS, 0))
    return LocatedCampaign(replace(found, shown_roughness=shown), base)


def _with_filtered_speed(campaign: Campaign) -> Campaign:
    """The campaign with an error of the speed that lasts for seconds, where that exceeds the white noise of a bin."""
    if campaign.white or campaign.accelerometer != "none" or all(r.split for r in campaign.runs):
        return campaign
    tried = replace(campaign, filtered=True)
    return tried if _shows_filtered_speed(weighted_start(tried)) else campaign


def _shows_filtered_speed(regression: Regression) -> bool:
    campaign, sizes = rows_of(regression).campaign, rows_of(regression).noise.sizes
    white = [lv["speed"] / np.sqrt(np.median(b.count)) for lv, b in zip(campaign.levels, campaign.bins, strict=True)]
    relative = COASTDOWN_POLICY.filtered_speed * sizes["speed_noise"] * float(np.median(white))
    return sizes["speed_drift"] > max(relative, COASTDOWN_POLICY.least_filtered_speed)


@dataclass(frozen=True)
class _RoadLikelihood:
    """The restricted likelihood of a campaign's road, with a free resistance over speed as nuisance.

    Parameters
    ----------
    regression : the baseline's. noisy : its runs for the noise model. known : (s,) prior information of their unknowns.
    response : for each run (b, b), response of its speed to the slope in each of its bins.
    """

    regression: Regression
    noisy: Sequence[NoisyRun]
    known: Array
    response: Sequence[Array]

    @property
    def rows(self) -> RoadLoadRows:
        """The baseline's rows."""
        return rows_of(self.regression)

    def __call__(self, tried: Sequence[Campaign], scales: Sequence[float] = (1.0,)) -> Array:
        """Log likelihood (k, l) of k campaigns with the roughness scaled by each of l factors."""
        random = self.rows.random()
        assert random is not None
        slopes = [[r @ binned_slopes(one, k) for k, r in enumerate(self.response)] for one in tried]
        every = [[scale * slope for slope in each] for each in slopes for scale in scales]
        found = likelihoods_of(self.noisy, self.rows.noise.sizes, self.known, random, every)
        return found.reshape(len(tried), len(scales))

    def roughness(self) -> float:
        """The most likely roughness, m/m."""
        return find_sizes(self.noisy, self.rows.noise.sizes, self.known, self.rows.random())[ROUGHNESS]


def _likelihood(campaign: Campaign, hats: int = HATS, regression: Regression | None = None) -> _RoadLikelihood:
    """The likelihood with a free resistance of ``hats`` hat functions, at the baseline's regression."""
    regression = weighted_start(campaign) if regression is None else regression
    at, runs = rows_of(regression).noise.at, range(len(campaign.runs))
    response = [slope_response(campaign, k, at) for k in runs]
    forces = [force_response(campaign, k, at) @ _free_forces(campaign, k, hats) for k in runs]
    noisy = [
        replace(n, shared=np.column_stack([n.shared, f])) for n, f in zip(noisy_runs(regression), forces, strict=True)
    ]
    known = np.r_[prior_information(regression), np.full(forces[0].shape[1], 1.0 / ANY_FORCE**2)]
    return _RoadLikelihood(regression, noisy, known, response)


def _with_spectrum(likelihood: _RoadLikelihood, campaign: Campaign, chosen: float = 0.0) -> tuple[Campaign, float]:
    """The campaign with the most likely spectrum, and the scale of its roughness; zero where the runs show no road.

    Parameters
    ----------
    chosen : log likelihood of this campaign minus that of the mixture from which it was selected.
    """
    tried = [replace(campaign, spectrum=k) for k in range(len(SPECTRA))]
    found = likelihood(tried, SCALES)
    most = found.max(axis=1)
    if most.max() - chosen - float(likelihood([campaign], (LEVEL,))[0, 0]) < COASTDOWN_POLICY.road_shown:
        return tried[DEFAULT_SPECTRUM], 0.0
    # Of about equally likely spectra take the one with the longest waves, which resembles a resistance most.
    k = max(np.flatnonzero(most >= most.max() - ABOUT).tolist())
    return tried[k], SCALES[int(np.argmax(found[k]))]


def _turned(likelihood: _RoadLikelihood, campaign: Campaign, scale: float) -> tuple[Campaign, float]:
    """The campaign and its scale with both directions on one road, as far as the runs show how they overlap.

    Without positions, few rows or a smooth road leave many distances between both starts possible. The most likely one
    would put the way back on a wrong road, which then looks like a slope, a headwind or a resistance.
    """
    turns, expected = possible_turns(campaign.runs)
    at = (scale or 1.0,)
    turned = [replace(campaign, turn=float(turn)) for turn in turns]
    gain = likelihood(turned, at)[:, 0] - likelihood([campaign], at)[0, 0] + expected
    evidence, k = float(np.log(np.sum(np.exp(gain - gain.max()))) + gain.max()), int(np.argmax(gain))
    chance = np.exp(gain - np.logaddexp(evidence, -np.log(COASTDOWN_POLICY.roads_apart)))
    found = chance[max(k - NEARBY, 0) : k + NEARBY + 1].sum() >= COASTDOWN_POLICY.turn_shown
    # A road that whole logs do not show is level enough for any distance; a few split times may not show a rough one.
    if not found and (scale or campaign.intervals):
        possible = zip(turns.tolist(), chance.tolist(), strict=True)
        return _with_spectrum(likelihood, replace(campaign, turns=tuple(p for p in possible if p[1] > NEVER)))
    # The evidence averages over all distances, because the most likely of many also fits noise.
    return _with_spectrum(likelihood, turned[k], float(gain[k] - expected[k]) - evidence)


def _finely_turned(likelihood: _RoadLikelihood, campaign: Campaign, scale: float, step: float) -> Campaign:
    """The campaign with the most likely distance between the starts of both directions near the present one.

    Shifts of single runs cannot find it, because shifting all runs of a direction also shifts the road.
    """
    if campaign.turn is None:
        return campaign
    tried = [replace(campaign, turn=campaign.turn + k * step) for k in range(-NEIGHBORS, NEIGHBORS + 1)]
    return tried[int(np.argmax(likelihood(tried, (scale,))[:, 0]))]


def _free_forces(campaign: Campaign, run: int, hats: int) -> Array:
    """Free forces of resistance and wind in each bin of a run, (b, f), in units of the weight.

    A slope acts on runs out and back with opposite signs, a resistance with the same sign. So the resistance may have
    any shape over the speed (hat functions), and the force that changes sign with the heading may be a cubic. Where
    all runs have one heading, only a cubic is free, because more would absorb the road.
    """
    runs = campaign.runs
    low, top = min(float(r.speed.min()) for r in runs), max(float(r.speed.max()) for r in runs)
    speed = campaign.bins[run].mean(runs[run].speed)[:, None]
    force = (speed / top) ** np.arange(POWERS)
    if campaign.both_ways:
        knots = np.linspace(low, top, max(hats, 2))
        free = np.maximum(1.0 - np.abs(speed - knots) / (knots[1] - knots[0]), 0.0) if hats else force
        force = np.column_stack([free, runs[run].heading * force])
    return np.asarray(force)


def _shifted(campaign: Campaign, near: Regression) -> Campaign:
    """The campaign with each run shifted along the road to where it fits best.

    One Gauss-Newton step: the derivative of a run's speed with respect to its place is its response to the change of
    slope per meter. Every shift has a normal prior of standard deviation PLACE and is limited to twice that.
    """
    regression = weighted_start(campaign, near)
    rows, start, layout = rows_of(regression), regression.start(), campaign.layout
    assert layout is not None
    assert rows.center is not None
    profile, shifts = layout.factor @ rows.center, list(campaign.shifts or [0.0] * len(campaign.runs))
    for k, bins in enumerate(campaign.bins):
        theta = regression.local(start, k)
        shifted = [layout.moved(k, way * SHIFT_STEP).weights(k) @ profile for way in (0.5, -0.5)]
        response = slope_response(campaign, k, rows.noise.at) @ bins.mean((shifted[0] - shifted[1]) / SHIFT_STEP)
        residual, jacobian = rows.binned(k, theta)
        matrix = np.column_stack([jacobian[:, len(rows.shared) :], response])
        white, change = whiten(residual, matrix, cholesky=rows.noise.factors[k])
        stacked = np.vstack([change, np.r_[np.zeros(matrix.shape[1] - 1), 1.0 / PLACE]])
        step = -np.linalg.lstsq(stacked, np.r_[white, shifts[k] / PLACE], rcond=None)[0][-1]
        shifts[k] = float(np.clip(shifts[k] + step, -2 * PLACE, 2 * PLACE))
    return replace(campaign, shifts=tuple(shifts))
