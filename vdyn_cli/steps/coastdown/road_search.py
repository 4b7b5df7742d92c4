"""Where the runs met the road that they share: its spectrum, the way back, and the place of each run.

All by the restricted likelihood of the runs together, before the fit that is published.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, likelihoods_of
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.noise import met_slopes, slope_response
from vdyn_cli.steps.coastdown.road_load_regression import prior_information, rows_of, weighted_start
from vdyn_cli.steps.coastdown.road_load_rows import ROUGHNESS, RoadLoadRows
from vdyn_cli.steps.coastdown.shared_road import DEFAULT_SPECTRUM, SPECTRA, possible_turns
from vdyn_cli.steps.step_policy import STEP_POLICY

ABOUT = 1.0  # of the log likelihood: a difference as chance makes it for each further parameter (Akaike)
LEVEL = 1e-3  # share of the roughness that is none
SCALES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of the roughness at which spectra are compared
PLACE = 30.0  # m, standard deviation between places at which runs of one direction begin: a tester aims at a mark
METER = 10.0  # m over which the change of slope is taken: half the distance of the road's knots
HATS, POWERS = 24, 4  # of a free resistance, a hat every 60 m or more; of a cubic, which a wind over speed resembles
ANY_FORCE = 0.02  # of the weight: prior standard deviation of such forces, twice a car's rolling resistance
REFINED, NEIGHBORS = (15.0, 5.0), 4  # m: steps of the distance between the starts, tried either way, round by round


@dataclass(frozen=True)
class LocatedCampaign:
    """A campaign on its road, and the baseline's weighted start there (``weighted_start``), where it was needed."""

    campaign: Campaign
    base: Regression | None = None


def located(campaign: Campaign) -> LocatedCampaign:
    """The campaign on the likeliest road, and with the roughness that turns with the heading.

    Where position is not logged, the distance between the starts of both directions is unknown, about that of a run.
    The way back lies on the road of the way out at the likeliest one, unless two roads that have nothing in common are
    ``roads_apart`` times as likely: then the directions keep profiles of their own.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    if campaign.layout is None:
        return LocatedCampaign(campaign)
    likelihood = _likelihood(campaign)
    found, scale = _with_spectrum(likelihood, campaign)
    if campaign.road is None and {r.heading for r in campaign.runs} == {1.0, -1.0}:
        found, scale = _turned(likelihood, found, scale)
    if campaign.road is None and scale:
        for step in REFINED:
            found = _shifted(_finely_turned(likelihood, found, scale, step), likelihood.regression)
    base = weighted_start(found, likelihood.regression)
    shown = min(_likelihood(found, hats, base).roughness() for hats in (HATS, 0))
    return LocatedCampaign(replace(found, shown_roughness=shown), base)


@dataclass(frozen=True)
class _RoadLikelihood:
    """The restricted likelihood of a campaign's road, beside any resistance.

    Parameters
    ----------
    regression : the baseline's. noisy : its runs for the noise model. known : (s,) prior information of their unknowns.
    response : (b, b) of each run, of its speed to the slope in each of its bins.
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
        """(k, l) log likelihood of each of k campaigns, its roughness scaled by each of l factors."""
        random = self.rows.random()
        assert random is not None
        slopes = [[r @ met_slopes(one, k) for k, r in enumerate(self.response)] for one in tried]
        every = [[scale * slope for slope in each] for each in slopes for scale in scales]
        found = likelihoods_of(self.noisy, self.rows.sizes, self.known, random, every)
        return found.reshape(len(tried), len(scales))

    def roughness(self) -> float:
        """The likeliest roughness."""
        return find_sizes(self.noisy, self.rows.sizes, self.known, self.rows.random())[ROUGHNESS]


def _likelihood(campaign: Campaign, hats: int = HATS, regression: Regression | None = None) -> _RoadLikelihood:
    """The likelihood beside a free resistance of so many hat functions, at the baseline's regression."""
    regression = weighted_start(campaign) if regression is None else regression
    rows, start = rows_of(regression), regression.start()
    runs = range(len(campaign.runs))
    noisy = [rows.noisy(k, regression.local(start, k), rows.at) for k in runs]
    response = [slope_response(campaign, k, rows.at) for k in runs]
    forces = [response[k] @ _free_forces(campaign, k, hats) for k in runs]
    noisy = [replace(n, shared=np.column_stack([n.shared, f])) for n, f in zip(noisy, forces, strict=True)]
    known = np.r_[prior_information(regression), np.full(forces[0].shape[1], 1.0 / ANY_FORCE**2)]
    return _RoadLikelihood(regression, noisy, known, response)


def _with_spectrum(likelihood: _RoadLikelihood, campaign: Campaign, chosen: float = 0.0) -> tuple[Campaign, float]:
    """The campaign with the likeliest spectrum, and the scale of its roughness; zero where the runs show no road.

    Parameters
    ----------
    chosen : by how much the log likelihood of this campaign exceeds that of all that were compared together.
    """
    tried = [replace(campaign, spectrum=k) for k in range(len(SPECTRA))]
    found = likelihood(tried, SCALES)
    most = found.max(axis=1)
    if most.max() - chosen - float(likelihood([campaign], (LEVEL,))[0, 0]) < STEP_POLICY.road_shown:
        return tried[DEFAULT_SPECTRUM], 0.0
    # Of spectra that are about as likely the one with the longest waves: they resemble a resistance most.
    k = max(np.flatnonzero(most >= most.max() - ABOUT).tolist())
    return tried[k], SCALES[int(np.argmax(found[k]))]


def _turned(likelihood: _RoadLikelihood, campaign: Campaign, scale: float) -> tuple[Campaign, float]:
    """The campaign and its scale with the way back on the road of the way out, where the runs do not deny that."""
    turns, expected = possible_turns(campaign.runs)
    at = (scale or 1.0,)
    turned = [replace(campaign, turn=float(turn)) for turn in turns]
    gain = likelihood(turned, at)[:, 0] - likelihood([campaign], at)[0, 0] + expected
    evidence, k = float(np.log(np.sum(np.exp(gain - gain.max()))) + gain.max()), int(np.argmax(gain))
    if evidence < -np.log(STEP_POLICY.roads_apart):
        return campaign, scale
    # Evidence of a road is that of all distances together: the likeliest of many fits noise, too.
    return _with_spectrum(likelihood, turned[k], float(gain[k] - expected[k]) - evidence)


def _finely_turned(likelihood: _RoadLikelihood, campaign: Campaign, scale: float, step: float) -> Campaign:
    """The campaign with the likeliest distance between the starts of both directions near the present one.

    The runs' own shifts cannot find it: a shift of all runs of a direction moves the road with it.
    """
    if campaign.turn is None:
        return campaign
    tried = [replace(campaign, turn=campaign.turn + k * step) for k in range(-NEIGHBORS, NEIGHBORS + 1)]
    return tried[int(np.argmax(likelihood(tried, (scale,))[:, 0]))]


def _free_forces(campaign: Campaign, run: int, hats: int) -> Array:
    """The forces in each bin of a run that a resistance or a wind may have, (b, f), in units of the weight.

    A road pushes the runs out and the runs back in opposite ways, a resistance alike. So a resistance of any shape
    over the speed is left free (hat functions), and what turns with the heading as far as a cubic describes it. Where
    all runs have one heading, a cubic is all: else nothing would be left of the road.
    """
    runs = campaign.runs
    low, top = min(float(r.speed.min()) for r in runs), max(float(r.speed.max()) for r in runs)
    speed = campaign.bins[run].mean(runs[run].speed)[:, None]
    force = (speed / top) ** np.arange(POWERS)
    if {1.0, -1.0} <= {r.heading for r in runs}:
        knots = np.linspace(low, top, max(hats, 2))
        free = np.maximum(1.0 - np.abs(speed - knots) / (knots[1] - knots[0]), 0.0) if hats else force
        force = np.column_stack([free, runs[run].heading * force])
    return np.asarray(force)


def _shifted(campaign: Campaign, near: Regression) -> Campaign:
    """The campaign with each run moved along the road to where it fits best: runs begin about PLACE apart.

    One step of Gauss and Newton: the derivative of a run's speed to its place is its response to the change of slope
    over a metre. Every shift has a normal prior of standard deviation PLACE, and moves by at most twice of it.
    """
    regression = weighted_start(campaign, near)
    rows, start, layout = rows_of(regression), regression.start(), campaign.layout
    assert layout is not None
    assert rows.center is not None
    profile, shifts = layout.factor @ rows.center, list(campaign.shifts or [0.0] * len(campaign.runs))
    for k, bins in enumerate(campaign.bins):
        theta = regression.local(start, k)
        steeper = [layout.moved(k, way * METER).weights(k) @ profile for way in (0.5, -0.5)]
        response = slope_response(campaign, k, rows.at) @ bins.mean((steeper[0] - steeper[1]) / METER)
        residual, jacobian = rows.binned(k, theta)
        matrix = np.column_stack([jacobian[:, len(rows.shared) :], response])
        white, change = whiten(residual, matrix, cholesky=rows.factors[k])
        stacked = np.vstack([change, np.r_[np.zeros(matrix.shape[1] - 1), 1.0 / PLACE]])
        step = -np.linalg.lstsq(stacked, np.r_[white, shifts[k] / PLACE], rcond=None)[0][-1]
        shifts[k] = float(np.clip(shifts[k] + step, -2 * PLACE, 2 * PLACE))
    return replace(campaign, shifts=tuple(shifts))
