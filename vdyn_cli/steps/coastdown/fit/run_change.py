"""Search for a change of the car between two runs: a trailer, a load, other tires, a roof box, a dragging brake.

It lasts to the end of the day, or for two successive runs, one out and one back, after which it is undone. The noise
amplitudes of the baseline's fit absorb such a change as wind and resistance that differ from run to run. So they are
estimated again beside each form of a change, and the forms are compared by their evidence (Bayes factor).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from vdyn_cli.inference import Regression
from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.inference.restricted_likelihood import NoisyRun, RandomUnknowns, likelihoods_of, log_evidence
from vdyn_cli.quantities.arrays import Array, Mask
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.steps.coastdown.fit.road_load_regression import noisy_runs, prior_information, rows_of
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS
from vdyn_cli.steps.coastdown.noise import force_response
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

CHANGE = 0.25  # prior standard deviation of a relative change: pumped tires and roof boxes 0.1 to 0.2, trailers to 0.5
SLOPE, WIND = 0.003, 1.5  # prior standard deviations of a mean slope (SAE J1263 allows 0.005), and of a mean wind, m/s
# Runs after which 63 % of the warming of tires is done: it takes 5 to 20 min, and a run with its return 2 to 10 min.
WARMING = (0.5, 1.0, 2.0, 4.0)
FEWEST = 2  # runs on either side of a change: fewer are an outlying run
LASTING = ("run_wind", "run_force")  # noise that lasts for a run, and absorbs a change
# Columns of a change: rolling resistance and drag area; the first alone (tires, a brake); the second alone (a roof box,
# or passengers, whose mass rolling resistance is in proportion to). Equally likely beforehand.
CHANGED = ([0, 1], [0], [1])
FORM = "form"  # name of the amplitude of a form in likelihoods_of


def changed_in(regression: Regression) -> Mask | None:
    """The runs (n,) with a changed car: all from one run on, or two in succession; None where the runs show no change.

    A change multiplies rolling resistance and drag area of these runs. It must be ``change_shown`` more likely than
    none, and ``change_over_gradual`` more than a gradual change over the runs or one of a single run.

    Parameters
    ----------
    regression : the baseline's ``weighted_start``, of coasts whose speed is fitted.
    """
    rows = rows_of(regression)
    place = {run: k for k, run in enumerate(dict.fromkeys(r.origin for r in rows.campaign.runs))}  # by their starts
    number = np.array([float(place[r.origin]) for r in rows.campaign.runs])
    count = int(number.max()) + 1
    if count < 2 * FEWEST:
        return None
    search = _search(regression)
    changes = [(number >= k).astype(float) for k in range(FEWEST, count - FEWEST + 1)]
    changes += [np.isin(number, (k, k + 1)).astype(float) for k in range(1, count - 2) if count > 2 * FEWEST]
    gradual = [number / count, *(np.exp(-number / w) for w in WARMING)]
    single = [(number == k).astype(float) for k in range(count)]
    found = search.quick([0.0 * number, *changes, *gradual, *single])
    tried, others = found[1 : 1 + len(changes)], found[1 + len(changes) :]
    best = changes[int(np.argmax(tried))]
    if tried.max() < found[0]:
        return None
    rivals = gradual[int(np.argmax(others[: len(gradual)]))], single[int(np.argmax(others[len(gradual) :]))]
    none = search.evidence(None)
    gain = search.evidence(best) - none
    if gain < COASTDOWN_POLICY.change_shown:
        return None
    rival = max(search.evidence(one) for one in rivals) - none
    return best > 0.0 if gain > rival + COASTDOWN_POLICY.change_over_gradual else None


@dataclass(frozen=True)
class _Search:
    """The runs at the baseline's fit, with a mean slope and wind, and what a change does to each.

    Parameters
    ----------
    runs : for the noise model. sizes : of the noise. known : (s,), prior information of the shared unknowns.
    random : the slopes of the road. changes : for each run (n, 2), response to a relative change of rolling resistance
        and drag area, in their prior standard deviations.
    """

    runs: Sequence[NoisyRun]
    sizes: dict[str, float]
    known: Array
    random: RandomUnknowns | None
    changes: Sequence[Array]

    def evidence(self, form: Array | None) -> float:
        """The log evidence, up to a constant, with a change that acts on each run by the factor ``form`` (runs,).

        It is the mean over CHANGED: an unknown that changes nothing costs 2 to 3 on a day of eight runs, so that
        passengers of a seventh of the mass (3.3 with both unknowns, 6.5 with drag alone) were not found.
        """
        if form is None:
            return log_evidence(self.runs, self.sizes, self.known, self.random)
        found = []
        for which in CHANGED:
            columns = (f * change[:, which] for f, change in zip(form, self.changes, strict=True))
            runs = [replace(r, shared=np.column_stack([r.shared, c])) for r, c in zip(self.runs, columns, strict=True)]
            found.append(log_evidence(runs, self.sizes, np.r_[self.known, np.ones(len(which))], self.random))
        return float(np.logaddexp.reduce(found) - np.log(len(found)))

    def quick(self, forms: Sequence[Array]) -> Array:
        """The log likelihood (k,) of k forms with the fitted noise, of which what lasts for a run is usual at most."""
        sizes = self.sizes | {n: min(self.sizes[n], SOURCES[n].typical) for n in LASTING} | {FORM: 1.0}
        known, width = self.known.copy(), self.known.size
        scale = np.ones(width)
        if self.random is not None:
            known[self.random.columns], scale[self.random.columns] = 1.0, sizes[ROUGHNESS]
        none = np.zeros(2)
        runs = [replace(r, shared=np.column_stack([r.shared * scale, 0.0 * c])) for r, c in self._pairs]
        tried = [[f * c for f, c in zip(form, self.changes, strict=True)] for form in forms]
        added = RandomUnknowns(FORM, np.array([width, width + 1], dtype=np.intp))
        return likelihoods_of(runs, sizes, np.r_[known, none], added, tried)

    @property
    def _pairs(self) -> Sequence[tuple[NoisyRun, Array]]:
        return list(zip(self.runs, self.changes, strict=True))


def _search(regression: Regression) -> _Search:
    rows, at_start, known = rows_of(regression), noisy_runs(regression), prior_information(regression)
    campaign, at = rows.campaign, {**rows.noise.at, **{u.name: u.start for u in regression.shared}}
    runs, changes = [], []
    for k, run in enumerate(campaign.runs):
        speed = campaign.bins[k].mean(run.speed)
        rolling = np.full(speed.size, at["rolling_resistance"])
        drag = 0.5 * at["air_density"] * at["drag_area"] * speed**2 / (at["mass"] * GRAVITY)
        response = force_response(campaign, k, at)
        changes.append(CHANGE * response @ np.column_stack([rolling, drag]))
        noisy = at_start[k]
        if campaign.both_ways:
            steady = np.column_stack([np.full(speed.size, SLOPE), 2.0 * WIND * drag / speed])
            noisy = replace(noisy, shared=np.column_stack([noisy.shared, run.heading * response @ steady]))
        runs.append(noisy)
    known = np.r_[known, 1.0, 1.0] if campaign.both_ways else known
    return _Search(runs, dict(rows.noise.sizes), known, rows.random(), changes)
