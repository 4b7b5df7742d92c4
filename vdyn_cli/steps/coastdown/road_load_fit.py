"""Fit of the road load: output error on the simulated speed (and specific force), whitened by the gusts.

Every run's start speed is an unknown of its own. Residuals are averaged over short bins and whitened with the
covariance of gusts, wind and sensor noise (gust_covariance). The sizes of the noise come from the residuals
(restricted_likelihood); fit and sizes are repeated in turn until they settle.

With an accelerometer the resistances see the measured speed, and the specific force shows them without the slope. On a
track both channels are fitted: the noise sizes decide which one counts where. On an open road (``alone``) only the
specific force is fitted.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.simulate import Simulated, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, approach, solve, whiten
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restricted_likelihood import NoisyRun, find_sizes, typical_sizes
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.noise import noise_of, wind_variance
from vdyn_cli.steps.coastdown.start_values import started

Array = NDArray[np.float64]
SUBSTEPS = 2  # between the nodes of a coast, which are a second apart
ROUNDS = 3  # of noise sizes and fit, at most
STEPS = 6  # of a fit with every candidate effect in, whose values are not published
SIZES_SETTLED = 0.05  # of the logarithm of a noise size
SETTLED = 1.0  # standard deviations that a round may move an estimate: within them the model is nearly linear
CONVERGED = 1e-6  # of one residual variance: a further step would move a value by 1e-3 of its standard deviation
START = "start.speed"


@dataclass(frozen=True)
class RoadLoadRows:
    """Binned residuals and derivatives of all runs, whitened with the factors of their covariances.

    Parameters
    ----------
    shared : names of the shared unknowns. at : value of every parameter of the model at which the noise was computed.
    sizes : of the noise, by source (gust_covariance.SOURCES).
    factors : of each run's covariance, lower triangular (m, m), or (m,) where it is diagonal.
    """

    campaign: Campaign
    simulator: Simulator
    shared: tuple[str, ...]
    at: Mapping[str, float]
    sizes: Mapping[str, float]
    factors: tuple[Array, ...]

    def binned(self, run: int, theta: Array) -> tuple[Array, Array]:
        """Residual (m,), simulated minus measured, and derivatives (m, s + own) of one run, before whitening."""
        campaign, k = self.campaign, theta.size
        start = theta[-1] if campaign.speed_fitted else campaign.runs[run].speed[0]
        try:
            seen = self.simulator(
                campaign.fit_drives[run], [*theta[: len(self.shared)], start, self.at["wind_variance"]]
            )
        except ResultError as error:  # far from the solution the simulation may be unstable
            raise ArithmeticError(str(error)) from error
        pairs = list(zip(campaign.channels, campaign.binned[run], strict=True))
        residual = [campaign.mean(run, seen.outputs[n]) - measured for n, measured in pairs]
        return np.concatenate(residual), np.concatenate(
            [campaign.mean(run, seen.sensitivities[n][:, :k]) for n, _ in pairs]
        )

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

    def weighted(self, sizes: Mapping[str, float], at: Mapping[str, float]) -> RoadLoadRows:
        """The same rows, whitened with other noise sizes and model parameters."""
        factors = tuple(noise_of(self.campaign, k, at).factor(sizes) for k in range(len(self.campaign.runs)))
        return replace(self, factors=factors, sizes=dict(sizes), at=dict(at))


@dataclass(frozen=True)
class RoadLoadFit:
    """The fitted road load with the noise that weighted it."""

    rows: RoadLoadRows
    regression: Regression
    solution: Solution

    @property
    def campaign(self) -> Campaign:
        """The fitted runs."""
        return self.rows.campaign

    @property
    def sizes(self) -> Mapping[str, float]:
        """Sizes of the noise, by source (gust_covariance.SOURCES)."""
        return self.rows.sizes

    @property
    def at(self) -> Mapping[str, float]:
        """Value of every parameter of the model at the solution, SI."""
        return {**self.rows.at, **self.solution.values}

    @property
    def inertia(self) -> float:
        """Mass with the rotating parts, kg."""
        return self.at["mass"] + self.at["rotating_mass"]

    @property
    def speeds(self) -> tuple[float, float]:
        """Lowest and highest speed of the fitted runs, m/s."""
        return float(min(r.speed.min() for r in self.campaign.runs)), float(
            max(r.speed.max() for r in self.campaign.runs)
        )

    def simulate(self, run: int) -> Simulated:
        """The run at its samples, with the fitted parameters."""
        fitted = self.solution.per_run.get(START)
        return self.simulate_with(
            run, self.at, float(self.campaign.runs[run].speed[0] if fitted is None else fitted[run])
        )

    def simulate_with(self, run: int, at: Mapping[str, float], start: float) -> Simulated:
        """The run at its samples, with parameters ``at`` (SI) and another start speed (m/s)."""
        values = {**at, START: start}
        theta = [values[n] for n in self.rows.simulator.unknowns]
        return self.rows.simulator(self.campaign.drives[run], theta, sensitivities=False)

    def residual(self, run: int) -> tuple[Array, Array]:
        """Binned rows of a run, simulated minus measured, and their derivatives to the run's own unknowns."""
        own = [float(v[run]) for v in self.solution.per_run.values()]
        residual, jacobian = self.rows.binned(run, np.array([*(self.at[n] for n in self.rows.shared), *own]))
        return residual, jacobian[:, len(self.rows.shared) :]


def fit_road_load(
    campaign: Campaign, effects: Sequence[Correction] = (), extra: Sequence[Unknown] = (), rounds: int = ROUNDS
) -> RoadLoadFit:
    """Estimate the unknowns and the noise in turns until the estimates settle.

    Parameters
    ----------
    effects, extra : corrections of the model's laws, and their unknowns, which are fitted beside the campaign's.
    rounds : most repetitions; plain least squares (``campaign.white``) needs none.

    Raises
    ------
    ResultError : the data do not determine the unknowns, or a value lies at its bound.
    """
    regression = _initial(campaign, effects, extra)
    if campaign.white and any(u.prior for u in regression.shared):
        regression = _scaled_to_residuals(regression)

    def refit(before: tuple[Regression, Solution]) -> tuple[tuple[Regression, Solution], float]:
        regression, old = before
        regression = _reweighted(regression, old.values, old.per_run)
        new = solve(regression, tolerance=CONVERGED)
        moves = (abs(new.values[n] - old.values[n]) / max(new.std[n], 1e-300) for n in new.names)
        return (regression, new), max(moves)

    first = regression, solve(regression, tolerance=CONVERGED)
    regression, solution = until_settled(refit, first, 0 if campaign.white else rounds, SETTLED).state
    return RoadLoadFit(rows_of(regression), _starting(regression, solution.values, solution.per_run), solution)


def regression_with_effects(
    campaign: Campaign, effects: Sequence[Correction], extra: Sequence[Unknown], rounds: int = ROUNDS
) -> Regression:
    """The regression at the baseline's fit with candidate effects beside it, and noise sizes free of their signals.

    The noise sizes come from the residual of a fit with baseline and all effects in, held together by their priors:
    sizes from the baseline alone would absorb the effects. The effects' unknowns then start at zero again.

    Parameters
    ----------
    effects, extra, rounds : as in ``fit_road_load``.

    Raises
    ------
    ResultError : the baseline cannot be fitted.
    """

    def reweight(before: Regression) -> tuple[Regression, float]:
        after = _reweighted(before, *approach(before, STEPS))
        old, new = rows_of(before).sizes, rows_of(after).sizes
        return after, max(abs(float(np.log(new[n] / old[n]))) for n in new)

    regression = _initial(campaign, effects, extra)
    regression = until_settled(reweight, regression, 0 if campaign.white else rounds, SIZES_SETTLED).state
    return _starting(regression, {u.name: u.start for u in extra}, {})


def rows_of(regression: Regression) -> RoadLoadRows:
    """The rows of a road load's regression, typed."""
    assert isinstance(regression.rows, RoadLoadRows)
    return regression.rows


def effects_of(regression: Regression) -> tuple[Effect, ...]:
    """The effects in the model of a road load's regression."""
    return tuple(e for e in rows_of(regression).simulator.effects if isinstance(e, Effect))


def transferred(regression: Regression, campaign: Campaign, values: Mapping[str, float]) -> Regression:
    """The same unknowns, effects and noise sizes for other runs of the same car.

    Parameters
    ----------
    regression : of the runs that were driven. campaign : the other runs, of the same model.
    values : of the shared unknowns; the noise is that of a car with these.
    """
    rows = rows_of(regression)
    at = {n: values.get(n, v) for n, v in campaign.values.items()} | {"wind_variance": rows.at["wind_variance"]}
    starts = {START: np.array([r.speed[0] for r in campaign.runs])} if campaign.speed_fitted else {}
    runs = tuple(r.name for r in campaign.runs)
    there = replace(rows, campaign=campaign).weighted(rows.sizes, at)
    return replace(regression, runs=runs, rows=there, run_starts=starts)


def _initial(campaign: Campaign, effects: Sequence[Correction], extra: Sequence[Unknown]) -> Regression:
    """The regression with typical noise sizes."""
    unknowns = (*started(campaign), *extra)
    names = tuple(u.name for u in unknowns)
    simulator = Simulator(
        campaign.model,
        campaign.values,
        unknowns=(*names, START, "wind_variance"),
        effects=effects,
        substeps=1 if campaign.nodes is None else SUBSTEPS,
    )
    sizes = typical_sizes(noise_of(campaign, 0, campaign.values))
    rows = RoadLoadRows(campaign, simulator, names, {}, {}, ()).weighted(sizes, campaign.values)
    starts = np.array([r.speed[: min(5, r.speed.size)].mean() for r in campaign.runs])
    own = (Unknown(START, 15.0, -5.0, 160.0, "m/s", per_run=True, nuisance=True),) if campaign.speed_fitted else ()
    return Regression((*unknowns, *own), tuple(r.name for r in campaign.runs), rows, {START: starts} if own else {})


def _scaled_to_residuals(regression: Regression) -> Regression:
    """White noise as large as the residuals at the start: priors then keep their weight beside it."""
    rows, start, squares = rows_of(regression), regression.start(), []
    for k in range(len(regression.runs)):
        residual, _ = rows.binned(k, regression.local(start, k))
        squares.append((residual / rows.factors[k]) ** 2)
    scale = max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1.0)
    return replace(regression, rows=rows.weighted({n: size * scale for n, size in rows.sizes.items()}, rows.at))


def _reweighted(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The regression started at these values, whitened with the noise sizes that its residuals there show."""
    rows, s = rows_of(regression), len(rows_of(regression).shared)
    at = {**rows.at, **shared}
    runs = []
    for k in range(len(rows.campaign.runs)):
        theta = np.array([*(shared[n] for n in rows.shared), *(own[u.name][k] for u in regression.own)])
        residual, jacobian = rows.binned(k, theta)
        runs.append(NoisyRun(residual, jacobian[:, :s], jacobian[:, s:], noise_of(rows.campaign, k, at)))
    known = np.array([1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in regression.shared])
    sizes = find_sizes(runs, rows.sizes, known)
    rows = rows.weighted(sizes, {**at, "wind_variance": wind_variance(sizes)})
    return replace(_starting(regression, shared, own), rows=rows)


def _starting(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The same regression, starting at these values; the others keep theirs."""
    unknowns = tuple(replace(u, start=shared.get(u.name, u.start)) for u in regression.unknowns)
    return replace(regression, unknowns=unknowns, run_starts={**regression.run_starts, **own})
