"""Where the runs met the road that they share: its spectrum, the way back, and the place of each run.

All by the restricted likelihood of the runs together, before the fit that is published.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import whiten
from vdyn_cli.inference.restricted_likelihood import likelihoods_of
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.noise import road_response, slope_response
from vdyn_cli.steps.coastdown.road_load_fit import rows_of, weighted_start
from vdyn_cli.steps.coastdown.shared_road import SPECTRA, USUAL, possible_turns

Array = NDArray[np.float64]

ABOUT = 1.0  # of the log likelihood: a difference as chance makes it for each further parameter (Akaike)
LEVEL, SHOWN = 1e-3, 2.0  # share of the roughness that is none; log likelihood from which a road is seen (p = 0.05)
SCALES = (0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 2.8, 4.0)  # of the roughness at which spectra are compared
APART = 10.0  # likelihood ratio, "strong" evidence (Jeffreys), from which the directions do not share one road
PLACE = 30.0  # m, standard deviation between places at which runs of one direction begin: a tester aims at a mark
METER = 10.0  # m over which the change of slope is taken: half the distance of the road's knots
SHIFTS = 2  # rounds: the second moves a run by a few meters


def located(campaign: Campaign) -> Campaign:
    """The campaign with the likeliest spectrum of its road, and the way back placed on the road of the way out.

    Where position is not logged, the distance between the starts of both directions is unknown, about that of a run.
    The way back lies on the road of the way out at the likeliest one, unless two roads that have nothing in common are
    APART times as likely: then the directions keep profiles of their own.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    if campaign.layout is None:
        return campaign
    regression = weighted_start(campaign)
    rows, random = rows_of(regression), rows_of(regression).random()
    assert random is not None
    runs = range(len(campaign.runs))
    start = regression.start()
    noisy = [rows.noisy(k, regression.local(start, k), rows.at) for k in runs]
    known = np.array([1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in regression.shared])

    def likely(tried: Sequence[Campaign], scales: Sequence[float] = (1.0,)) -> Array:
        slopes = [[road_response(one, k, rows.at) for k in runs] for one in tried]
        every = [[scale * slope for slope in each] for each in slopes for scale in scales]
        return likelihoods_of(noisy, rows.sizes, known, random, every).reshape(len(tried), len(scales))

    def likeliest(one: Campaign) -> tuple[Campaign, float]:
        tried = [replace(one, spectrum=k) for k in range(len(SPECTRA))]
        found = likely(tried, SCALES)
        most = found.max(axis=1)
        # Of spectra that are about as likely the one with the longest waves: they resemble a resistance most.
        shown = most.max() - float(likely([one], (LEVEL,))[0, 0]) > SHOWN
        k = max(np.flatnonzero(most >= most.max() - ABOUT).tolist()) if shown else USUAL
        return tried[k], SCALES[int(np.argmax(found[k]))] if shown else 0.0

    best, scale = likeliest(campaign)
    if campaign.road is not None or {r.heading for r in campaign.runs} != {1.0, -1.0}:
        return best
    turns, expected = possible_turns(campaign.runs)
    turned = [replace(best, turn=float(turn)) for turn in turns]
    at = (scale or 1.0,)
    gain = likely(turned, at)[:, 0] - likely([best], at)[0, 0] + expected
    if float(np.log(np.sum(np.exp(gain - gain.max()))) + gain.max()) < -np.log(APART):
        return _shifted(best) if scale else best
    found, scale = likeliest(turned[int(np.argmax(gain))])
    return _shifted(found) if scale else found


def _shifted(campaign: Campaign) -> Campaign:
    """The campaign with each run moved along the road to where it fits best: runs begin about PLACE apart.

    One step of Gauss and Newton a round: the derivative of a run's speed to its place is its response to the change of
    slope over a metre. Every shift has a normal prior of standard deviation PLACE, and moves by at most twice of it.
    """
    for _ in range(SHIFTS):
        regression = weighted_start(campaign)
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
        campaign = replace(campaign, shifts=tuple(shifts))
    return campaign
