"""Estimating the road load from runs: output error on the simulated speed (and specific force), whitened by the gusts.

Every run's start speed is an unknown of its own. Residuals are averaged over short bins and whitened with the
covariance of what gusts, wind and sensors do to them (gust_noise). Its sizes come from the data
(restricted_likelihood): found at one fit, they weigh the next.

With an accelerometer the resistances see the measured speed and the specific force tells them without the slope. On a
track both channels are fitted together: where the road is flat the speed knows more, where it is not the accelerometer
does, and the noise sizes decide. On an open road (``alone``) the specific force alone is fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.simulate import Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, approach, solve, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, typical_sizes
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.road_load_start import started
from vdyn_cli.steps.coastdown.road_runs import Campaign, noise_of

Array = NDArray[np.float64]
SUBSTEPS = 2  # between the nodes of a coast, which are a second apart
ROUNDS = 3  # of noise sizes and fit, at most
STEPS = 6  # of a fit with every cause in, whose answer nobody asks for
SIZES_SETTLED = 0.05  # of the logarithm of a noise size
SETTLED = 1.0  # standard deviations that a round may move an estimate: within them the model is straight
ARRIVED = 1e-6  # of one residual variance: a further step would move a value by 1e-3 of its standard deviation
START = "start.speed"


@dataclass(frozen=True)
class RoadLoadFit:
    """The answer with the noise that weighed it.

    Parameters
    ----------
    sizes : of the noise, by source (gust_noise.SOURCES).
    at : value of every parameter of the model at the solution.
    """

    campaign: Campaign
    regression: Regression
    solution: Solution
    sizes: Mapping[str, float]
    at: Mapping[str, float]
    simulator: Simulator

    def simulate(self, run: int) -> Simulated:
        """The run with the fitted parameters."""
        fitted = self.solution.per_run.get(START)
        start = float(self.campaign.runs[run].speed[0] if fitted is None else fitted[run])
        return self.trace(run, self.at, start)

    def trace(self, run: int, at: Mapping[str, float], start: float) -> Simulated:
        """The run at its samples, with other parameters and start speed."""
        values = {**at, START: start}
        theta = [values[n] for n in self.simulator.unknowns]
        return self.simulator(self.campaign.drives[run], theta, sensitivities=False)

    def residual(self, run: int) -> tuple[Array, Array]:
        """Binned rows of a run, simulated less measured, and their derivatives to the run's own unknowns."""
        rows = self.regression.rows
        assert isinstance(rows, _Rows)
        own = [float(v[run]) for v in self.solution.per_run.values()]
        residual, jacobian = rows.binned(run, np.array([*(self.at[n] for n in rows.shared), *own]))
        return residual, jacobian[:, len(rows.shared) :]


@dataclass(frozen=True)
class _Rows:
    """Binned residuals and derivatives of all runs, before whitening."""

    campaign: Campaign
    simulator: Simulator
    shared: tuple[str, ...]
    wind_variance: float = 0.0
    factors: tuple[Array, ...] = ()
    sizes: Mapping[str, float] = field(default_factory=dict)
    _measured: dict[int, Array] = field(default_factory=dict)

    def binned(self, run: int, theta: Array) -> tuple[Array, Array]:
        """Residual (m,), simulated less measured, and derivatives (m, s + own) of one run."""
        campaign, k = self.campaign, theta.size
        start = theta[-1] if campaign.speed_fitted else campaign.runs[run].speed[0]
        others = theta[: len(self.shared)]
        try:
            seen = self.simulator(campaign.fit_drives[run], [*others, start, self.wind_variance])
        except ResultError as error:  # far off, a trial may be beyond what the step size bears
            raise ArithmeticError(str(error)) from error
        parts = [
            (campaign.mean(run, seen.outputs[n]) - measured, campaign.mean(run, seen.sensitivities[n][:, :k]))
            for n, measured in self._channels(run)
        ]
        if len(parts) == 1:
            return parts[0]
        return np.concatenate([p[0] for p in parts]), np.concatenate([p[1] for p in parts])

    def _channels(self, run: int) -> list[tuple[str, Array]]:
        names = self.campaign.channels
        if run not in self._measured:
            one, bins = self.campaign.runs[run], self.campaign.bins[run]
            self._measured[run] = np.array([bins.mean(one.channel(n)) for n in names])
        return list(zip(names, self._measured[run], strict=True))

    def __call__(self, run: int, theta: Array) -> Rows:
        residual, jacobian = self.binned(run, theta)
        main = self.campaign.bins[run].time.size
        plain = residual[:main], jacobian[:main]
        factor = self.factors[run]
        if factor.ndim == 1:
            residual, jacobian = residual / factor, jacobian / factor[:, None]
        else:
            residual, jacobian = whiten(residual, jacobian, cholesky=factor)
        time = np.tile(self.campaign.bins[run].time, len(self.campaign.channels))
        return Rows(residual, jacobian, time=time, plain=plain)


def fit_road_load(
    campaign: Campaign, effects: Sequence[Correction] = (), extra: Sequence[Unknown] = (), rounds: int = ROUNDS
) -> RoadLoadFit:
    """Estimate the unknowns and the noise in turns until they stay.

    Parameters
    ----------
    effects, extra : corrections of the model's laws, and their unknowns to be fitted beside the campaign's.

    Raises
    ------
    ResultError : the data do not determine the unknowns, or a value lies at its bound.
    """
    rows, regression = _begin(campaign, effects, extra)
    sizes = typical_sizes(noise_of(campaign, 0, campaign.values))
    at = dict(campaign.values)
    if campaign.white and any(u.prior for u in regression.shared):
        sizes = _as_large_as_misses(rows, regression, sizes, at)
    rows, solution = _weighted_fit(rows, regression, sizes, at)
    for _ in range(0 if campaign.white else rounds):
        at.update(solution.values)
        sizes = _sizes(rows, regression, solution.values, solution.per_run, sizes, at)
        at["wind_variance"] = wind_variance(sizes)
        regression, before = _from(regression, solution), solution
        rows, solution = _weighted_fit(rows, regression, sizes, at)
        if all(abs(solution.values[n] - before.values[n]) < SETTLED * solution.std[n] for n in solution.names):
            break
    at.update(solution.values)
    final = replace(_from(regression, solution), rows=rows)
    return RoadLoadFit(campaign, final, solution, sizes, at, rows.simulator)


def scan_road_load(
    campaign: Campaign, effects: Sequence[Correction], extra: Sequence[Unknown], rounds: int = ROUNDS
) -> Regression:
    """The regression at the baseline's fit with candidate causes beside it, whose traces the noise is freed of.

    The noise comes from the residual of a fit with base and all causes in, held together by their priors: found after
    the baseline alone it would swallow what is sought. The causes' unknowns then start where they began, at nothing.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """
    rows, full = _begin(campaign, effects, extra)
    sizes = typical_sizes(noise_of(campaign, 0, campaign.values))
    at = dict(campaign.values)
    rows = _weighted(rows, sizes, at)
    for _ in range(0 if campaign.white else rounds):
        shared, own = approach(replace(full, rows=rows), STEPS)
        full = _starting(full, shared, own)
        at.update({n: v for n, v in shared.items() if n in at})
        before, sizes = sizes, _sizes(rows, full, shared, own, sizes, at)
        at["wind_variance"] = wind_variance(sizes)
        rows = _weighted(rows, sizes, at)
        if all(abs(np.log(sizes[n] / before[n])) < SIZES_SETTLED for n in sizes):
            break
    nothing = {u.name: u.start for u in extra}
    return _starting(replace(full, rows=rows), nothing, {})


def campaign_of(regression: Regression) -> Campaign:
    """The runs that a road load's regression is of."""
    assert isinstance(regression.rows, _Rows)
    return regression.rows.campaign


def transferred(regression: Regression, campaign: Campaign, values: Mapping[str, float]) -> Regression:
    """The same unknowns, causes and noise sizes for other runs of the same car.

    Parameters
    ----------
    regression : of the runs that were driven. campaign : the other runs, of the same model.
    values : of the shared unknowns; the noise is that of a car with these.
    """
    rows = regression.rows
    assert isinstance(rows, _Rows)
    at = {n: values.get(n, v) for n, v in campaign.values.items()} | {"wind_variance": rows.wind_variance}
    there = _Rows(campaign, rows.simulator, rows.shared)
    starts = {START: np.array([r.speed[0] for r in campaign.runs])} if campaign.speed_fitted else {}
    runs = tuple(r.name for r in campaign.runs)
    return replace(regression, runs=runs, rows=_weighted(there, rows.sizes, at), run_starts=starts)


def wind_variance(sizes: Mapping[str, float]) -> float:
    """Variance of the wind along the track, m^2/s^2, within and between runs."""
    return sizes.get("gust", 0.0) ** 2 + sizes.get("run_wind", 0.0) ** 2


def _begin(campaign: Campaign, effects: Sequence[Correction], extra: Sequence[Unknown]) -> tuple[_Rows, Regression]:
    unknowns = (*started(campaign), *extra)
    names = tuple(u.name for u in unknowns)
    simulator = Simulator(
        campaign.model,
        campaign.values,
        unknowns=(*names, START, "wind_variance"),
        effects=effects,
        substeps=1 if campaign.nodes is None else SUBSTEPS,
    )
    rows = _Rows(campaign, simulator, names)
    starts = np.array([r.speed[: min(5, r.speed.size)].mean() for r in campaign.runs])
    own = (Unknown(START, 15.0, -5.0, 160.0, "m/s", per_run=True, nuisance=True),) if campaign.speed_fitted else ()
    runs = tuple(r.name for r in campaign.runs)
    return rows, Regression((*unknowns, *own), runs, rows, {START: starts} if own else {})


def _weighted_fit(
    rows: _Rows, regression: Regression, sizes: Mapping[str, float], at: Mapping[str, float]
) -> tuple[_Rows, Solution]:
    rows = _weighted(rows, sizes, at)
    return rows, solve(replace(regression, rows=rows), tolerance=ARRIVED)


def _weighted(rows: _Rows, sizes: Mapping[str, float], at: Mapping[str, float]) -> _Rows:
    factors = tuple(noise_of(rows.campaign, k, at).factor(sizes) for k in range(len(rows.campaign.runs)))
    return replace(rows, factors=factors, wind_variance=at["wind_variance"], sizes=dict(sizes))


def _as_large_as_misses(
    rows: _Rows, regression: Regression, sizes: Mapping[str, float], at: Mapping[str, float]
) -> dict[str, float]:
    """White sizes that make the residuals at the start their own noise: beside them priors keep their weight."""
    start, squares = regression.start(), []
    for k in range(len(regression.runs)):
        residual, _ = rows.binned(k, regression.local(start, k))
        squares.append((residual / noise_of(rows.campaign, k, at).factor(sizes)) ** 2)
    scale = float(np.sqrt(np.mean(np.concatenate(squares))))
    return {name: size * max(scale, 1.0) for name, size in sizes.items()}


def _from(regression: Regression, solution: Solution) -> Regression:
    """The same regression, beginning at a solution."""
    return _starting(regression, solution.values, solution.per_run)


def _starting(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The same regression, beginning at these values; the others keep theirs."""
    unknowns = tuple(replace(u, start=shared.get(u.name, u.start)) for u in regression.unknowns)
    return replace(regression, unknowns=unknowns, run_starts={**regression.run_starts, **own})


def _sizes(
    rows: _Rows,
    regression: Regression,
    shared: Mapping[str, float],
    own: Mapping[str, Array],
    start: Mapping[str, float],
    at: Mapping[str, float],
) -> dict[str, float]:
    s = len(rows.shared)
    each = [own[u.name] for u in regression.own]
    runs = []
    for k in range(len(rows.campaign.runs)):
        theta = np.array([*(shared[n] for n in rows.shared), *(o[k] for o in each)])
        residual, jacobian = rows.binned(k, theta)
        runs.append(NoisyRun(residual, jacobian[:, :s], jacobian[:, s:], noise_of(rows.campaign, k, at)))
    known = np.array([1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in regression.shared])
    return find_sizes(runs, start, known)
