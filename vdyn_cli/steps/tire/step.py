"""The step ``tire``: its description, its problem and its result."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.description.test_description import Si, Strict, TestSpec
from vdyn_cli.effects import Effect
from vdyn_cli.engine.model import Model
from vdyn_cli.inference import Regression, Solution, Unknown, solve
from vdyn_cli.physics.models.tire_curve import SHAPE, SLIP_CURVE, TIRE_CURVE, peak_slip
from vdyn_cli.quantities.errors import Finding, InputError, ResultError, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.quantities.result import Comparison, Figure, FitSummary, Result, Series, Table
from vdyn_cli.steps.contract import Diagnosable, Step, from_functions
from vdyn_cli.steps.effect_estimates import sizes_found, unbounded
from vdyn_cli.steps.free_profiles import profile, span_of
from vdyn_cli.steps.tire.bins import Bins, bin_sweep
from vdyn_cli.steps.tire.tire_regression import TireFit

Array = NDArray[np.float64]

# The shape of passenger car tyres, mean and standard deviation: all that is known of a curve whose peak was not driven.
FREE_FORCE = 300.0  # N, of a free profile
SHAPES = {"tire_C": (1.6, 0.15), "tire_E": (0.0, 0.6)}
SHORTEST = 40  # samples of a sweep
FEWEST_TO_COMPARE = 3  # sweeps, of which one may be unlike the others


class TireSettings(Strict):
    """Which samples count: slip is meaningless at crawling speed, friction without load."""

    minimum_speed: Annotated[Given, Si("m/s", 0.1, 50)] = Given(1.0)
    minimum_load: Annotated[Given, Si("N", 1, 50_000)] = Given(300.0)


class TireSpec(TestSpec):
    """A tyre test's description."""

    settings: TireSettings = TireSettings()


def sweeps(spec: TireSpec, logs: Sequence[Log], known: Parameters) -> tuple[Log, ...]:
    """The logs with slip where it means something.

    Raises
    ------
    InputError : no slip and no speeds to compute it from, an upside-down convention, or too little left.
    """
    if not logs:
        raise InputError(Finding("runs", "no slip sweep is given", remedy="list at least one log under runs"))
    found, findings = [], []
    for log in logs:
        if "slip" not in log and not ("wheel_speed" in log and "vehicle_speed" in log):
            remedy = "map 'wheel_speed' and 'vehicle_speed', or 'slip'"
            findings.append(Finding("channels", "slip can't be had", remedy=remedy))
            break
        with_slip = log if "slip" in log else _with_slip(log, spec, known)
        upside_down = _upside_down(with_slip)
        if upside_down:
            findings.append(upside_down)
            continue
        used = np.isfinite(with_slip["slip"]) & (with_slip["force_z"] > spec.settings.minimum_load.value)
        used &= np.isfinite(with_slip["force_x"])
        if np.count_nonzero(used) < SHORTEST:
            got = f"{np.count_nonzero(used)} of {used.size} samples"
            findings.append(Finding(log.name, f"fewer than {SHORTEST} samples have speed, load and force", got))
            continue
        found.append(with_slip.with_channels(slip=np.where(used, with_slip["slip"], np.nan)))
    raise_all(dict.fromkeys(findings))
    return tuple(found)


def _with_slip(log: Log, spec: TireSpec, known: Parameters) -> Log:
    known.require("wheel_radius", where="tire")
    speed = log["vehicle_speed"]
    moving = np.abs(speed) > spec.settings.minimum_speed.value
    radius = known["wheel_radius"].value
    slip = log["wheel_speed"] * radius / np.where(moving, speed, 1.0) - 1
    return log.with_channels(slip=np.where(moving, slip, np.nan))


def _upside_down(log: Log) -> Finding | None:
    """A load or force whose sign contradicts physics, with the line that mends it."""
    load, force, slip = log["force_z"], log["force_x"], log["slip"]
    line = "add 'sign: -1' to its channel"
    if np.nanmedian(load) < 0:
        return Finding(f"{log.name}, force_z", "the tyre is pulled up: Fz must be positive when it is loaded", "", line)
    good = np.isfinite(force) & np.isfinite(slip) & (np.abs(slip) < 0.3)
    if np.count_nonzero(good) > SHORTEST and np.sum(force[good] * slip[good]) < 0:
        return Finding(f"{log.name}, force_x", "the tyre drives while it slips backwards: Fx must be positive when it "
                       "drives the car", "", line)  # fmt: skip
    return None


@dataclass(frozen=True)
class Fitted:
    """The curve as far as the sweeps tell it; ``peak`` is the slip of its peak, None where no sweep got there."""

    fit: TireFit
    solution: Solution
    peak: float | None


def _fitted(
    bins: Sequence[Bins], radius_std: float, effects: Sequence[Effect] = (), extra: Sequence[Unknown] = ()
) -> Fitted:
    """The whole curve where the sweeps go beyond its peak, else one whose shape is free within what tyres have."""
    furthest = max(float(np.abs(b.slip).max()) for b in bins)
    fit = TireFit(bins, None, radius_std, effects, extra)
    try:
        solution = fit.solve()
        peak = peak_slip(*(solution.values[n] for n in ("tire_B", "tire_C", "tire_E")))
        if peak < furthest:
            return Fitted(fit, solution, peak)
    except ResultError:
        pass  # the shape beyond the slope is not determined
    fit = TireFit(bins, SHAPES, radius_std, effects, extra)
    return Fitted(fit, fit.solve(), None)


def _data(spec: TireSpec, logs: Sequence[Log], known: Parameters) -> tuple[tuple[Log, ...], list[Bins], float]:
    """The sweeps, averaged, and the relative standard deviation of the radius that their slip was computed with."""
    data = sweeps(spec, logs, known)
    radius = known.estimates.get("wheel_radius")
    radius_std = radius.std / radius.value if radius and "slip" not in logs[0] else 0.0
    return data, [bin_sweep(log) for log in data], radius_std


def model(spec: TireSpec, logs: Sequence[Log], known: Parameters) -> Model:
    """The curve, with or without a speed."""
    return TIRE_CURVE if all("vehicle_speed" in log for log in logs) else SLIP_CURVE


def regression(
    spec: TireSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Regression:
    """All bins of all sweeps, with ``effects`` on the curve.

    Slips are projected onto the curve that the fit with all effects finds, where the sweeps determine that (with
    priors on ``extra`` they always do), else onto the plain one.

    Parameters
    ----------
    extra : the effects' unknowns, shared by all sweeps; those left out stay zero, or nominal.
    """
    _, bins, radius_std = _data(spec, logs, known)
    plain = _fitted(bins, radius_std)
    fit, whole = (TireFit(bins, plain.fit.shape, radius_std, effects, x) for x in (extra, unbounded(extra)))
    start = plain.solution.values
    try:
        at = solve(whole.regression(start)).values if extra else start
    except ResultError:
        at = start
    return fit.regression(at, start)


def profiles(spec: TireSpec, logs: Sequence[Log], known: Parameters) -> tuple[Effect, ...]:
    """Forces that are free over the slip and over the load."""
    used = sweeps(spec, logs, known)
    slip = span_of([log["slip"] for log in used], 0.01)
    load = span_of([log["force_z"] for log in used], 10.0)
    return (
        profile("force_over_slip", "tire", "slip", slip, FREE_FORCE, "N"),
        profile("force_over_load", "tire", "load", load, FREE_FORCE, "N"),
    )


def estimate(
    spec: TireSpec,
    logs: Sequence[Log],
    known: Parameters,
    effects: Sequence[Effect] = (),
    extra: Sequence[Unknown] = (),
) -> Result:
    """Fit the curve, and the unknowns of ``effects`` if there are any; publish what the sweeps determine."""
    data, bins, radius_std = _data(spec, logs, known)
    try:
        found = _fitted(bins, radius_std, effects, extra)
    except ResultError as error:
        odd = () if effects else _odd(data, bins, radius_std)
        raise ResultError(*odd, *error.findings) from None
    if found.peak is not None:
        return _whole(found.fit, found.solution, found.peak, data)
    return _slope_only(found.fit, found.solution, data)


def _odd(data: Sequence[Log], bins: Sequence[Bins], radius_std: float) -> tuple[Finding, ...]:
    """The one sweep without which the others make a curve, where there is just one."""
    found = []
    for k, log in enumerate(data if len(data) >= FEWEST_TO_COMPARE else ()):
        try:
            if _fitted([b for i, b in enumerate(bins) if i != k], radius_std, (), ()).peak is not None:
                found.append(log.name)
        except ResultError:
            continue
    if len(found) != 1:
        return ()
    what = "is not like the other sweeps, which make a curve without it"
    return (Finding(found[0], what, remedy="look at it: a wet or cold road, another load, a channel that failed"),)


def _slope(solution: Solution) -> tuple[float, float, tuple[float, float]]:
    """B C D with its standard deviation and interval."""
    b, c, d = (solution.values[n] for n in ("tire_B", "tire_C", "tire_D"))
    gradient = {"tire_B": c * d, "tire_C": b * d, "tire_D": b * c}
    return b * c * d, solution.std_of(gradient), solution.interval_of(b * c * d, gradient)


def _whole(fit: TireFit, solution: Solution, peak: float, logs: Sequence[Log]) -> Result:
    value, std, interval = _slope(solution)
    estimates = {n: Estimate.of(n, solution.values[n], solution.std[n], solution.interval95[n], "tire") for n in SHAPE}
    estimates["tire_longitudinal_stiffness"] = Estimate.of("tire_longitudinal_stiffness", value, std, interval, "tire")
    correlation = {a: {b: solution.correlation[a][b] for b in SHAPE} for a in SHAPE}
    grip = solution.values["tire_D"]
    sentence = (
        f"The tyre grips with {grip:.3f} (95 %: {_span(solution.interval95['tire_D'], 3)}) at {peak:.1%} of slip and "
        f"starts with a slope of {value:.2f} per unit of slip (95 %: {_span(interval, 2)})."
    )
    return _result(fit, solution, Parameters(estimates, correlation), sentence, (), logs, peak)


def _slope_only(fit: TireFit, solution: Solution, logs: Sequence[Log]) -> Result:
    """The slope at zero slip alone; the rest of the curve is free within what tyres have."""
    bins = fit.sweeps
    furthest = max(float(np.abs(b.slip).max()) for b in bins)
    value, std, interval = _slope(solution)
    name = "tire_longitudinal_stiffness"
    most = max(float(np.max(np.abs(b.force / b.load))) for b in bins)
    warning = (
        f"no sweep goes beyond the peak (largest slip {furthest:.1%}, largest friction {most:.2f}): B, C, D and E are "
        "not determined one by one, only their product B C D is; sweep to two or three times the slip of the peak"
    )
    sentence = (
        f"The tyre's slope at zero slip is {value:.2f} per unit of slip (95 %: {_span(interval, 2)}); "
        "its peak was not reached."
    )
    parameters = Parameters({name: Estimate.of(name, value, std, interval, "tire")})
    return _result(fit, solution, parameters, sentence, (warning,), logs, None)


def _span(interval: tuple[float, float], digits: int) -> str:
    return f"{interval[0]:.{digits}f} to {interval[1]:.{digits}f}"


def _result(
    fit: TireFit,
    solution: Solution,
    parameters: Parameters,
    sentence: str,
    warnings: tuple[str, ...],
    logs: Sequence[Log],
    peak: float | None,
) -> Result:
    feet = [fit.foot(run, solution.values) for run in range(len(fit.sweeps))]
    off = [f.force + f.slope * (b.slip - f.slip) - b.force for f, b in zip(feet, fit.sweeps, strict=True)]
    comparisons = tuple(
        Comparison(b.run, "force_x", "N", b.time, "time in s", b.force, b.force + r)
        for b, r in zip(fit.sweeps, off, strict=True)
    )
    every = np.concatenate(off)
    summary = FitSummary(
        tuple(b.run for b in fit.sweeps),
        float(np.sqrt(np.mean(every**2))),
        float(np.sqrt(np.mean(np.concatenate([f.deviation for f in feet]) ** 2))),
        "N",
        solution.names,
        solution.unit,
        solution.n_units,
        warnings=(*solution.warnings, *warnings),
    )
    figures = (_curve_figure(fit, solution, peak), _residual_figure(fit, off))
    findings = tuple(f for log in logs for f in log.findings)
    return Result(
        "tire", sentence, parameters, summary, METHODS, comparisons, figures, (_noise_table(fit),), findings,
        sizes_found(solution, fit.extra),
    )  # fmt: skip


def _curve_figure(fit: TireFit, solution: Solution, peak: float | None) -> Figure:
    slip = np.concatenate([b.slip for b in fit.sweeps])
    friction = np.concatenate([b.force / b.load for b in fit.sweeps])
    grid = np.linspace(slip.min(), slip.max(), 300)
    load = float(np.mean(np.concatenate([b.load for b in fit.sweeps])))
    curve = fit.force(grid, load, solution.values) / load
    series = [
        Series("measured, averaged", slip, friction, "points"),
        Series("magic formula", grid, curve, role="simulated"),
    ]
    if peak is not None:
        at = np.array([peak])
        series.append(Series("peak", at, fit.force(at, load, solution.values) / load, "points", role="accent"))
    caption = (
        "Friction over slip. Good: the points scatter evenly about the line on both sides of zero and beyond the peak. "
        "Bad: a cloud that crosses zero beside the origin (wheel radius or force zero), one branch above the other "
        "(load or speed changes the friction), or points that end before the peak."
    )
    return Figure("curve", "Friction over slip", caption, "slip", "Fx / Fz", tuple(series))


def _residual_figure(fit: TireFit, off: Sequence[Array]) -> Figure:
    series = [
        Series(b.run, b.slip, -r / b.load, "points", role="residual") for b, r in zip(fit.sweeps, off, strict=True)
    ]
    caption = (
        "What the curve leaves, in units of friction. Good: no shape. Bad: a wave near the knee (another curve), a "
        "slope through zero (slip zero), or sweeps one above the other (load sensitivity)."
    )
    return Figure("residual", "Measured less curve, over slip", caption, "slip", "friction", tuple(series))


def _noise_table(fit: TireFit) -> Table:
    rows = [
        (b.run, f"{b.slip.min():.1%}", f"{b.slip.max():.1%}", f"{np.mean(b.load):.0f} N", str(b.slip.size),
         f"{np.sqrt(np.mean(b.slip_variance)):.2%}", f"{np.sqrt(np.mean(b.force_variance)):.1f} N")
        for b in fit.sweeps
    ]  # fmt: skip
    columns = ("sweep", "slip from", "slip to", "mean load", "bins", "noise of slip", "noise of force")
    caption = "Noise is that of a bin's mean, from third differences of the channel."
    return Table("sweeps", "The sweeps", columns, tuple(rows), caption)


METHODS = (
    "Slip from wheel speed, radius and vehicle speed; samples averaged over stretches in which slip moves by at most "
    "1.5 %; magic formula fitted by the distance in slip and force together, the noise of each channel taken from its "
    "third differences and the second-order effect of slip noise removed; wheel radius a nuisance unknown within its "
    "standard deviation; intervals from the scatter of blocks of equal information (Bell and McCaffrey 2002)."
)

STEP = Step(
    name="tire",
    situations=frozenset({"slip_sweep"}),
    spec=TireSpec,
    required=("time", "force_x", "force_z"),
    optional=("slip", "wheel_speed", "vehicle_speed"),
    needs=("wheel_radius",),
    gives=(*SHAPE, "tire_longitudinal_stiffness"),
    prepare=from_functions(estimate=estimate, regression=regression, model=model, profiles=profiles),
    diagnosable=Diagnosable(metric=("force", "N"), run="sweep"),
)
