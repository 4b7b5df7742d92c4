"""Search for a change of the car between two runs: a trailer, a load, other tires, a roof box, a dragging brake.

It lasts to the end of the day, or for two successive runs, one out and one back, after which it is undone. The noise
amplitudes of the baseline's fit absorb such a change as wind and resistance that differ from run to run. So they are
estimated again beside each form of a change, and the forms are compared by their evidence (Bayes factor).

A wind along the track that turns slowly is a rival: with a period of nearly an even number of runs, runs out and back
meet it with the same sign over half of the day. It differs from a change within the runs::

    w(t) = a cos(2 pi t / P) + b sin(2 pi t / P),   t the time of day, P from two runs to twice the day
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
from vdyn_cli.steps.coastdown.fit.campaign import Campaign
from vdyn_cli.steps.coastdown.fit.road_load_regression import noisy_runs, prior_information, rows_of
from vdyn_cli.steps.coastdown.fit.road_load_rows import ROUGHNESS
from vdyn_cli.steps.coastdown.noise import force_response
from vdyn_cli.steps.coastdown.policy import COASTDOWN_POLICY

Form = Sequence[Array]  # what changes each run: (n, 2), responses to two unknowns per prior standard deviation

CHANGE = 0.25  # prior standard deviation of a relative change: pumped tires and roof boxes 0.1 to 0.2, trailers to 0.5
SLOPE, WIND = 0.003, 1.5  # prior standard deviations of a mean slope (SAE J1263 allows 0.005), and of a mean wind, m/s
# Runs after which 63 % of the warming of tires is done: it takes 5 to 20 min, and a run with its return 2 to 10 min.
WARMING = (0.5, 1.0, 2.0, 4.0)
FEWEST = 2  # runs on either side of a change: fewer are an outlying run
LASTING = ("run_wind", "run_force")  # noise that lasts for a run, and absorbs a change
# Columns of a change: rolling resistance and drag area; the first alone (tires, a brake); the second alone (a roof box,
# or passengers, whose mass rolling resistance is in proportion to). Equally likely beforehand.
CHANGED = ([0, 1], [0], [1])
BOTH = ([0, 1],)  # columns of a slow wind: cosine and sine
FORM = "form"  # name of the amplitude of a form in likelihoods_of


def changed_in(regression: Regression) -> Mask | None:
    """The runs (n,) with a changed car: all from one run on, or two in succession; None where the runs show no change.

    A change multiplies rolling resistance and drag area of these runs. It must be ``change_shown`` more likely than
    none, and ``change_over_gradual`` more than a gradual change over the runs, one of a single run, or a slow wind.

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
    forms = [search.form(factors) for factors in changes]
    none, *likelihoods = search.quick([search.form(0.0 * number), *forms])
    best = int(np.argmax(likelihoods))
    if likelihoods[best] < none:
        return None
    change = search.evidence(forms[best], CHANGED)
    if change < search.evidence() + COASTDOWN_POLICY.change_shown:
        return None
    rivals = [([search.form(f) for f in gradual], CHANGED), ([search.form(f) for f in single], CHANGED)]
    for others, columns in (*rivals, (search.winds, BOTH)):
        rival = search.evidence(others[int(np.argmax(search.quick(others)))], columns) if others else -np.inf
        if change < rival + COASTDOWN_POLICY.change_over_gradual:
            return None
    return np.asarray(changes[best] > 0.0)


@dataclass(frozen=True)
class _Search:
    """The runs at the baseline's fit, with a mean slope and wind, and what a change does to each.

    Parameters
    ----------
    runs : for the noise model. sizes : of the noise. known : (s,), prior information of the shared unknowns.
    random : the slopes of the road.
    changes : of all runs, the response to a relative change of rolling resistance and drag area.
    winds : of slow winds of some periods; none where the runs have no times of day.
    """

    runs: Sequence[NoisyRun]
    sizes: dict[str, float]
    known: Array
    random: RandomUnknowns | None
    changes: Form
    winds: Sequence[Form]

    def form(self, factors: Array) -> Form:
        """A change that acts on each run by its factor (runs,)."""
        return [f * change for f, change in zip(factors, self.changes, strict=True)]

    def evidence(self, form: Form = (), columns: Sequence[Sequence[int]] = ()) -> float:
        """The log evidence, up to a constant, with a form of which these columns are free; the mean over ``columns``.

        An unknown that changes nothing costs 2 to 3 on a day of eight runs, so that passengers of a seventh of the mass
        (3.3 with both unknowns, 6.5 with drag alone) were not found.
        """
        if not columns:
            return log_evidence(self.runs, self.sizes, self.known, self.random)
        found = []
        for which in columns:
            pairs = zip(self.runs, form, strict=True)
            runs = [replace(r, shared=np.column_stack([r.shared, own[:, which]])) for r, own in pairs]
            found.append(log_evidence(runs, self.sizes, np.r_[self.known, np.ones(len(which))], self.random))
        return float(np.logaddexp.reduce(found) - np.log(len(found)))

    def quick(self, forms: Sequence[Form]) -> Array:
        """The log likelihood (k,) of k forms with the fitted noise, of which what lasts for a run is usual at most."""
        sizes = self.sizes | {n: min(self.sizes[n], SOURCES[n].typical) for n in LASTING} | {FORM: 1.0}
        known, width = self.known.copy(), self.known.size
        scale = np.ones(width)
        if self.random is not None:
            known[self.random.columns], scale[self.random.columns] = 1.0, sizes[ROUGHNESS]
        pairs = zip(self.runs, self.changes, strict=True)
        runs = [replace(r, shared=np.column_stack([r.shared * scale, 0.0 * c])) for r, c in pairs]
        added = RandomUnknowns(FORM, np.array([width, width + 1], dtype=np.intp))
        return likelihoods_of(runs, sizes, np.r_[known, 0.0, 0.0], added, forms)


def _search(regression: Regression) -> _Search:
    rows, at_start, known = rows_of(regression), noisy_runs(regression), prior_information(regression)
    campaign, at = rows.campaign, {**rows.noise.at, **{u.name: u.start for u in regression.shared}}
    runs, changes, steady = [], [], []
    for k, run in enumerate(campaign.runs):
        speed = campaign.bins[k].mean(run.speed)
        rolling = np.full(speed.size, at["rolling_resistance"])
        drag = 0.5 * at["air_density"] * at["drag_area"] * speed**2 / (at["mass"] * GRAVITY)
        response = force_response(campaign, k, at)
        changes.append(CHANGE * response @ np.column_stack([rolling, drag]))
        steady.append((run.heading or 1.0) * response * (2.0 * WIND * drag / speed))
        noisy = at_start[k]
        if campaign.both_ways:
            alike = np.column_stack([run.heading * SLOPE * response.sum(axis=1), steady[-1].sum(axis=1)])
            noisy = replace(noisy, shared=np.column_stack([noisy.shared, alike]))
        runs.append(noisy)
    known = np.r_[known, 1.0, 1.0] if campaign.both_ways else known
    return _Search(runs, dict(rows.noise.sizes), known, rows.random(), changes, _slow_winds(campaign, steady))


def _slow_winds(campaign: Campaign, steady: Sequence[Array]) -> list[Form]:
    """Winds of periods from two runs to twice the day; ``steady``: each run's response (n, n) to a wind over time."""
    times = [r.start + r.since + b.time - r.time[0] for r, b in zip(campaign.runs, campaign.bins, strict=True)]
    day, starts = max(t[-1] for t in times) - min(t[0] for t in times), len({r.start for r in campaign.runs})
    turns = [np.pi * k / day for k in range(1, starts)] if starts > 1 else []
    return [
        [own @ np.column_stack([np.cos(w * t), np.sin(w * t)]) for own, t in zip(steady, times, strict=True)]
        for w in turns
    ]
