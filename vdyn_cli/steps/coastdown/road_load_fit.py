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
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from scipy.special import chdtrc

from vdyn_cli.effects import Effect
from vdyn_cli.engine.course import blocks
from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.inference import RefusedFitError, Regression, Rows, Solution, Unknown, approach, solve, whiten
from vdyn_cli.inference.gust_covariance import SOURCES
from vdyn_cli.inference.iterate import until_settled
from vdyn_cli.inference.restricted_likelihood import (
    NoisyRun,
    RandomUnknowns,
    find_sizes,
    typical_sizes,
)
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.coastdown.campaign import Campaign
from vdyn_cli.steps.coastdown.noise import LARGEST_GUST, noise_of, road_response, wind_variance
from vdyn_cli.steps.coastdown.shared_road import (
    describes_road,
    independent_slopes,
    road_unknowns,
    slope_factor,
)
from vdyn_cli.steps.coastdown.start_values import started

SUBSTEPS = 1  # between the nodes of a coast, a second apart: half of it moves no estimate by 1e-6 of its interval
ROUNDS = 3  # of noise sizes and fit, at most
STEPS = 6  # of a fit with every candidate effect in, whose values are not published
NEAR = 0.1  # share by which the baseline's unknowns move beside all candidates, which describe larger changes
SIZES_SETTLED = 0.05  # of the logarithm of a noise size
SETTLED = 1.0  # standard deviations that a round may move an estimate: within them the model is nearly linear
CONVERGED = 1e-6  # of one residual variance: a further step would move a value by 1e-3 of its standard deviation
IMPLAUSIBLE = 1e-3  # probability of a rougher road, below which a road is not one of the roughness shown
WORTH_COMPILING = 100  # runs times blocks of unknowns that are saved in every iteration: code for one takes 0.2 s
START = "start.speed"
ROUGHNESS = "roughness"
ANY: Mapping[str, float] = MappingProxyType({})  # noise of any size


@dataclass(frozen=True, eq=False)
class _SimulatedRun:
    """A run as a simulator gave it at some values of its unknowns, averaged over the bins: (m,) and (m, k)."""

    simulator: Simulator
    drive: Drive
    values: list[float]
    channels: Array
    sensitivities: Array


@dataclass(frozen=True)
class RoadLoadRows:
    """Binned residuals and derivatives of all runs, whitened with the factors of their covariances.

    Parameters
    ----------
    shared : names of the shared unknowns. at : value of every parameter of the model at which the noise was computed.
    sizes : of the noise, by source (gust_covariance.SOURCES).
    factors : of each run's covariance, lower triangular (m, m), or (m,) where it is diagonal.
    road : names of the unknowns of the road that the runs share, linear and independent with a prior of one each.
    slopes : (b, k) of each run, response of its rows to them where the road's roughness is one.
    center : (k,) the road's unknowns times the roughness, with which the runs are simulated; the rest is linear.
    drives : the runs with that slope.
    hills : names of the unknowns of an effect that describes the road: slopes at equal knots along it.
    made : the last simulation of each run.
    """

    campaign: Campaign
    simulator: Simulator
    shared: tuple[str, ...]
    at: Mapping[str, float]
    sizes: Mapping[str, float]
    factors: tuple[Array, ...]
    road: tuple[str, ...] = ()
    slopes: tuple[Array, ...] = ()
    center: Array | None = None
    drives: tuple[Drive, ...] = ()
    hills: tuple[str, ...] = ()
    made: dict[int, _SimulatedRun] = field(default_factory=dict, compare=False, repr=False)

    @cached_property
    def simulated(self) -> tuple[str, ...]:
        """The shared unknowns that enter the simulation."""
        road = set(self.road)
        return tuple(n for n in self.shared if n not in road)

    @cached_property
    def road_columns(self) -> NDArray[np.intp]:
        """Indices of the road's unknowns among the shared ones."""
        return np.array([self.shared.index(n) for n in self.road], dtype=np.intp)

    @cached_property
    def simulated_columns(self) -> NDArray[np.intp]:
        """Indices of the other shared unknowns."""
        return np.delete(np.arange(len(self.shared)), self.road_columns)

    def binned(self, run: int, theta: Array) -> tuple[Array, Array]:
        """Residual (m,), simulated minus measured, and derivatives (m, s + own) of one run, before whitening."""
        shared = theta[: len(self.shared)]
        inside = np.concatenate([self.simulated_columns, np.arange(shared.size, theta.size)])
        simulated, columns = self._simulated(run, theta[inside])
        residual = simulated - np.concatenate(self.campaign.binned[run])
        jacobian = np.zeros((residual.size, theta.size))
        jacobian[:, inside] = columns
        if self.road:
            jacobian[:, self.road_columns] = self.sizes[ROUGHNESS] * self.slopes[run]
            residual = residual + jacobian[:, self.road_columns] @ (shared[self.road_columns] - self.reference)
        return residual, jacobian

    def _simulated(self, run: int, theta: Array) -> tuple[Array, Array]:
        """The channels of one run (m,) and their derivatives (m, k), simulated and averaged over the bins.

        The last answer is kept: a fit ends, and the noise and the intervals begin, where it was computed last.
        """
        campaign = self.campaign
        start = theta[-1] if campaign.speed_fitted else campaign.runs[run].speed[0]
        values = [*theta[: len(self.simulated)].tolist(), float(start), self.at["wind_variance"]]
        drive = self.drives[run] if self.drives else campaign.fit_drives[run]
        made = self.made.get(run)
        if made is not None and made.simulator is self.simulator and made.drive is drive and made.values == values:
            return made.channels, made.sensitivities
        try:
            seen = self.simulator(drive, values)
        except ResultError as error:  # far from the solution the simulation may be unstable
            raise ArithmeticError(str(error)) from error
        channels = np.concatenate([campaign.mean(run, seen.outputs[n]) for n in campaign.channels])
        slopes = (seen.sensitivities[n][:, : theta.size] for n in campaign.channels)
        columns = np.concatenate([campaign.mean(run, s) for s in slopes])
        self.made[run] = _SimulatedRun(self.simulator, drive, values, channels, columns)
        return channels, columns

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
        return Rows(residual, jacobian, time=time, plain=plain, apart=self.campaign.runs[run].split)

    def narrowed(self, free: Sequence[str], held: Mapping[str, float]) -> RoadLoadRows | None:
        """The same rows over the unknowns ``free``, in that order, the others being held at these values.

        None where the simulation of all runs with fewer unknowns takes less time than making its machine code, or
        where a slope of the road is held.
        """
        before, after = (len(blocks(len(names) - len(self.road) + 2)) for names in (self.shared, free))
        if (before - after) * len(self.campaign.runs) < WORTH_COMPILING or not set(self.road) <= set(free):
            return None
        own = self.simulator
        simulator = Simulator(
            own.model,
            {**self.campaign.values, **held},
            unknowns=(*(n for n in free if n not in set(self.road)), START, "wind_variance"),
            effects=own.effects,
            substeps=1 if self.campaign.nodes is None else SUBSTEPS,
        )
        return replace(self, shared=tuple(free), simulator=simulator)

    @property
    def reference(self) -> Array:
        """The road's unknowns at which the runs are simulated, (k,)."""
        assert self.center is not None
        return self.center / self.sizes[ROUGHNESS]

    def on_road(self, shared: Mapping[str, float]) -> RoadLoadRows:
        """The same rows, simulated on the road that these unknowns describe."""
        layout = self.campaign.layout
        if layout is None or not self.road:
            return self
        center = self.sizes[ROUGHNESS] * np.array([shared[n] for n in self.road])
        profile = layout.factor @ center
        drives = []
        for k, drive in enumerate(self.campaign.fit_drives):
            slope = np.interp(drive.time, self.campaign.runs[k].time, layout.weights(k) @ profile)
            drives.append(replace(drive, inputs={**drive.inputs, "grade": np.asarray(drive.inputs["grade"]) + slope}))
        return replace(self, center=center, drives=tuple(drives))

    def weighted(self, sizes: Mapping[str, float], at: Mapping[str, float]) -> RoadLoadRows:
        """The same rows, whitened with other noise sizes and model parameters."""
        runs = range(len(self.campaign.runs))
        factors = tuple(noise_of(self.campaign, k, at).factor(sizes) for k in runs)
        slopes = (
            tuple(_of_width(road_response(self.campaign, k, at), len(self.road)) for k in runs) if self.road else ()
        )
        return replace(self, factors=factors, sizes=dict(sizes), at=dict(at), slopes=slopes)

    @cached_property
    def hill_factor(self) -> Array:
        """Lower triangular factor (k, k) of the correlation of the slopes that an effect describes."""
        assert self.campaign.road is not None
        return slope_factor(np.linspace(*self.campaign.road, len(self.hills)), self.campaign.spectrum)

    def random(self) -> RandomUnknowns | None:
        """The slopes of the road as random unknowns of the noise model; None where there are none."""
        least = self.campaign.roughness or 0.0
        if self.hills:
            return RandomUnknowns(ROUGHNESS, np.array([self.shared.index(n) for n in self.hills], dtype=np.intp), least)
        return RandomUnknowns(ROUGHNESS, self.road_columns, least) if self.road else None

    def noisy(self, run: int, theta: Array, at: Mapping[str, float]) -> NoisyRun:
        """The run for the noise model, its random unknowns independent with derivatives per unit of roughness."""
        residual, jacobian = self.binned(run, theta)
        s = len(self.shared)
        shared = jacobian[:, :s].copy()
        random = self.random()
        if random is not None:
            columns = random.columns
            residual = residual - shared[:, columns] @ theta[columns]
            shared[:, columns] = shared[:, columns] @ self.hill_factor if self.hills else self.slopes[run]
        return NoisyRun(residual, shared, jacobian[:, s:], noise_of(self.campaign, run, at))


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
        drive = self.campaign.drives[run]
        if self.rows.road:
            grade = np.asarray(drive.inputs["grade"]) + self.slope(run, at)
            drive = replace(drive, inputs={**drive.inputs, "grade": grade})
        return self.rows.simulator(drive, theta, sensitivities=False)

    def slope(self, run: int, at: Mapping[str, float]) -> Array:
        """The shared road's slope, uphill for the run, at its samples, (n,) m/m; zero where no road is shared."""
        layout = self.campaign.layout
        if layout is None or not self.rows.road:
            return np.zeros(self.campaign.runs[run].time.size)
        share = np.array([at[n] for n in self.rows.road])
        return np.asarray(self.sizes[ROUGHNESS] * (layout.weights(run) @ (layout.factor @ share)))

    def residual(self, run: int) -> tuple[Array, Array]:
        """Binned rows of a run, simulated minus measured, and their derivatives to the run's own unknowns."""
        own = [float(v[run]) for v in self.solution.per_run.values()]
        residual, jacobian = self.rows.binned(run, np.array([*(self.at[n] for n in self.rows.shared), *own]))
        return residual, jacobian[:, len(self.rows.shared) :]


def _of_width(columns: Array, width: int) -> Array:
    """The first columns, or zeros behind them: planned runs over another stretch have as many unknowns of the road."""
    missing = max(width - columns.shape[1], 0)
    return np.pad(columns, ((0, 0), (0, missing)))[:, :width]


def fit_road_load(
    campaign: Campaign,
    effects: Sequence[Correction] = (),
    extra: Sequence[Unknown] = (),
    rounds: int = ROUNDS,
    base: Regression | None = None,
) -> RoadLoadFit:
    """Estimate the unknowns and the noise in turns until the estimates settle.

    Parameters
    ----------
    effects, extra : corrections of the model's laws, and their unknowns, which are fitted beside the campaign's.
    rounds : most repetitions; plain least squares (``campaign.white``) needs none.
    base : the campaign's ``weighted_start``, where that is at hand; a fit without effects starts there.

    Raises
    ------
    ResultError : the data do not determine the unknowns, or a value lies at its bound.
    """
    regression = _initial(campaign, effects, extra) if base is None or effects else base
    if campaign.white and any(u.prior for u in regression.shared):
        regression = _scaled_to_residuals(regression)

    def refit(before: tuple[Regression, Solution]) -> tuple[tuple[Regression, Solution], float]:
        regression, old = before
        regression = _reweighted(regression, old.values, old.per_run)
        new = solve(regression, tolerance=CONVERGED)
        moves = (abs(new.values[n] - old.values[n]) / max(new.std[n], 1e-300) for n in new.names)
        return (regression, new), max(moves)

    try:
        first = regression, solve(regression, tolerance=CONVERGED)
    except RefusedFitError:
        if campaign.white:
            raise
        # The typical noise sizes may be far from those of this day, and push an estimate out of its range.
        regression = _reweighted(regression, *approach(regression, STEPS))
        first = regression, solve(regression, tolerance=CONVERGED)
    regression, solution = until_settled(refit, first, 0 if campaign.white else rounds, SETTLED).state
    return RoadLoadFit(rows_of(regression), _starting(regression, solution.values, solution.per_run), solution)


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
    regression = _initial(replace(campaign, level_mean=True), effects, extra)
    base = weighted_start(campaign) if base is None else base
    largest = _largest(campaign)
    if any(rows_of(base).sizes.get(n, 0.0) > size for n, size in largest.items()):
        base = weighted_start(campaign, most=largest)
    if campaign.white:
        return _starting(regression, {u.name: u.start for u in base.shared}, base.run_starts)
    known, at = rows_of(base), rows_of(base).at
    sizes = {**rows_of(regression).sizes, **typical_sizes(noise_of(campaign, 0, at))}
    values = {u.name: u.start for u in base.shared}
    if campaign.shown_roughness is not None and ROUGHNESS in sizes:
        sizes[ROUGHNESS] = max(campaign.shown_roughness, campaign.roughness or 0.0)
        values |= _road_values(rows_of(regression), known, sizes[ROUGHNESS])
    level = replace(regression, rows=rows_of(regression).weighted(sizes, at))
    level = _with_hill_prior(_starting(_near(level, values), values, base.run_starts))

    def resize(before: Regression) -> tuple[Regression, float]:
        after = _resized(before, *approach(before, STEPS))
        old, new = rows_of(before).sizes, rows_of(after).sizes
        return after, max(abs(float(np.log(new[n] / old[n]))) for n in new)

    settled = until_settled(resize, level, rounds, SIZES_SETTLED).state
    sized, starts = rows_of(settled), {u.name: u.start for u in settled.shared}
    road = np.array([values[n] for n in sized.road])
    if chdtrc(road.size, float(road @ road)) < IMPLAUSIBLE:
        values |= {n: starts[n] for n in sized.road}
    return _with_hill_prior(_starting(replace(regression, rows=sized.on_road(values)), values, base.run_starts))


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


def with_noise_of(known: Regression, effects: Sequence[Correction], extra: Sequence[Unknown]) -> Regression:
    """The regression with other effects, on the road and with the noise sizes of a known one of the same campaign.

    Parameters
    ----------
    known : whose noise and starts are taken. effects, extra : as in ``fit_road_load``.
    """
    base = rows_of(known)
    regression = _at_center(_initial(base.campaign, effects, extra), base)
    return _starting(_with_hill_prior(regression), {u.name: u.start for u in known.shared}, dict(known.run_starts))


def _at_center(regression: Regression, base: RoadLoadRows) -> Regression:
    """The regression on the road and with the noise sizes of the baseline's rows."""
    rows = replace(rows_of(regression), center=base.center, drives=base.drives)
    return replace(regression, rows=rows.weighted(base.sizes, base.at))


def weighted_start(campaign: Campaign, near: Regression | None = None, most: Mapping[str, float] = ANY) -> Regression:
    """The baseline's regression after a few steps, with the noise sizes that its residuals show.

    Parameters
    ----------
    near : the same of the same runs elsewhere on the road, from which one round is enough.
    most : largest noise of a source.

    Raises
    ------
    ResultError : the model has no finite value at the start.
    """
    regression = _initial(campaign, (), ())
    if near is not None:
        sizes, at = rows_of(near).sizes, rows_of(near).at
        begin = {u.name: u.start for u in near.shared if u.name not in set(rows_of(near).road)}
        regression = replace(regression, rows=rows_of(regression).weighted(sizes, at))
        regression = _starting(_with_hill_prior(regression), begin, near.run_starts)
    for _ in range(2 if near is None else 1):
        regression = _reweighted(regression, *approach(regression, STEPS), most)
    return regression


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
    level = None if rows.center is None else np.zeros_like(rows.center)
    there = replace(rows, campaign=campaign, center=level, drives=()).weighted(rows.sizes, at)
    return replace(regression, runs=runs, rows=there, run_starts=starts)


def _initial(campaign: Campaign, effects: Sequence[Correction], extra: Sequence[Unknown]) -> Regression:
    """The regression with typical noise sizes."""
    hills = tuple(n for e in effects if describes_road(e) for n in e.unknowns) if campaign.speed_fitted else ()
    hills = hills if hills and {u.name for u in extra} >= set(hills) else ()
    campaign = replace(campaign, level_road=campaign.level_road or any(describes_road(e) for e in effects))
    layout = campaign.layout
    road = () if layout is None else road_unknowns(layout)
    unknowns = (*started(campaign), *road, *extra)
    names = tuple(u.name for u in unknowns)
    sizes = typical_sizes(noise_of(campaign, 0, campaign.values))
    if (hills or road) and not campaign.white:
        sizes[ROUGHNESS] = max(SOURCES[ROUGHNESS].typical, campaign.roughness or 0.0)
    else:
        hills = ()
    inside = [n for n in names if n not in {u.name for u in road}]
    simulator = Simulator(
        campaign.model,
        campaign.values,
        unknowns=(*inside, START, "wind_variance"),
        effects=effects,
        substeps=1 if campaign.nodes is None else SUBSTEPS,
    )
    level = np.zeros(len(road)) if road else None
    rows = RoadLoadRows(campaign, simulator, names, {}, {}, (), tuple(u.name for u in road), center=level, hills=hills)
    rows = rows.weighted(sizes, campaign.values)
    starts = np.array([r.speed[: min(5, r.speed.size)].mean() for r in campaign.runs])
    own = (Unknown(START, 15.0, -5.0, 160.0, "m/s", per_run=True, nuisance=True),) if campaign.speed_fitted else ()
    names = tuple(r.name for r in campaign.runs)
    return _with_hill_prior(Regression((*unknowns, *own), names, rows, {START: starts} if own else {}))


def _with_hill_prior(regression: Regression) -> Regression:
    """The slopes that an effect describes get the prior of a road of the noise's roughness.

    Without one, a valley between the starts of both directions is collinear with a force that grows with the speed.
    """
    rows = rows_of(regression)
    if not rows.hills:
        return regression
    correlation = rows.hill_factor @ rows.hill_factor.T
    prior, degrees = (0.0, rows.sizes[ROUGHNESS]), independent_slopes(rows.hill_factor)
    related = {
        a: dict(zip(rows.hills, row.tolist(), strict=True)) for a, row in zip(rows.hills, correlation, strict=True)
    }
    unknowns = tuple(
        replace(u, prior=prior, prior_correlation=related[u.name], prior_degrees=degrees) if u.name in related else u
        for u in regression.unknowns
    )
    return replace(regression, unknowns=unknowns)


def _scaled_to_residuals(regression: Regression) -> Regression:
    """White noise as large as the residuals at the start: priors then keep their weight beside it."""
    rows, start, squares = rows_of(regression), regression.start(), []
    for k in range(len(regression.runs)):
        residual, _ = rows.binned(k, regression.local(start, k))
        squares.append((residual / rows.factors[k]) ** 2)
    scale = max(float(np.sqrt(np.mean(np.concatenate(squares)))), 1.0)
    return replace(regression, rows=rows.weighted({n: size * scale for n, size in rows.sizes.items()}, rows.at))


def _reweighted(
    regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array], most: Mapping[str, float] = ANY
) -> Regression:
    """The regression started at these values, whitened with the noise sizes that its residuals there show."""
    rows = rows_of(regression)
    at = {**rows.at, **shared}
    runs = []
    for k in range(len(rows.campaign.runs)):
        theta = np.array([*(shared[n] for n in rows.shared), *(own[u.name][k] for u in regression.own)])
        runs.append(rows.noisy(k, theta, at))
    sizes = find_sizes(runs, rows.sizes, prior_information(regression), rows.random(), most=most)
    rows = rows.on_road(shared).weighted(sizes, {**at, "wind_variance": wind_variance(sizes)})
    if rows.road:  # the same slopes in units of another roughness
        shared = {**shared, **dict(zip(rows.road, rows.reference.tolist(), strict=True))}
    return _with_hill_prior(replace(_starting(regression, shared, own), rows=rows))


def _resized(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The regression started at these values, with the noise sizes that its residuals there show.

    The road keeps the roughness that it showed, and the car its response to the noise.
    """
    rows, random, held = rows_of(regression), rows_of(regression).random(), {}
    regression = _starting(regression, shared, own)
    start = regression.start()
    runs = [rows.noisy(k, regression.local(start, k), rows.at) for k in range(len(regression.runs))]
    if random is not None and rows.campaign.shown_roughness is not None:
        held = {ROUGHNESS: rows.sizes[ROUGHNESS]}
        random = replace(random, least=held[ROUGHNESS])
    sizes = find_sizes(
        runs, rows.sizes, prior_information(regression), random, most={**_largest(rows.campaign), **held}
    )
    return replace(regression, rows=rows.weighted(sizes, {**rows.at, "wind_variance": wind_variance(sizes)}))


def prior_information(regression: Regression) -> Array:
    """(s,) inverse prior variance of the shared unknowns, zero without a prior."""
    return np.array([1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in regression.shared])


def _largest(campaign: Campaign) -> dict[str, float]:
    """Largest noise of a source: of coasts, gusts beyond what weather allows are a force that the model misses.

    For the diagnosis. The fit that is published keeps noise of any size: what is missed then counts as noise.

    Beside an accelerometer that feels the road, gusts hold what it does not.
    """
    return {"gust": LARGEST_GUST} if campaign.drive == "coasting" and campaign.accelerometer == "none" else {}


def _starting(regression: Regression, shared: Mapping[str, float], own: Mapping[str, Array]) -> Regression:
    """The same regression, starting at these values; the others keep theirs."""
    unknowns = tuple(replace(u, start=shared.get(u.name, u.start)) for u in regression.unknowns)
    return replace(regression, unknowns=unknowns, run_starts={**regression.run_starts, **own})
