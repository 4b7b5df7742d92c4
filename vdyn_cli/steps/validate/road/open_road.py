"""Findings of an extended model on open roads: resistance, roads, accelerometer zero, and held-out drives."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.inference import Regression, Solution, approach
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import normal_interval
from vdyn_cli.steps.validate.car.simulation import SimulationSetup
from vdyn_cli.steps.validate.drives.segments import RUN_START
from vdyn_cli.steps.validate.fit.drive_regression import ZERO
from vdyn_cli.steps.validate.fit.effect_fit import FittedEffects
from vdyn_cli.steps.validate.road.road_slope import DRIVE_SLOPE, RoadProfile

HOLDING_KMH = (30.0, 60.0, 90.0, 120.0)  # km/h, speeds at which the resistance is stated
WARM = 7200.0  # s of driving, after which tires and driveline are warm
INSTANT = 0.1  # s, over which an acceleration is simulated
SEASON_KMH, LEAST_GAP = 60.0, 8.0  # km/h, K
TEST_TORQUE = 20.0  # N m, arbitrary, since the acceleration is linear in the torque
FIT_STEPS = 8  # iterations of a fit to all drives except one
FEWEST_DRIVES = 3  # drives from which one is held out


@dataclass(frozen=True)
class IntervalEstimate:
    """A value with its standard deviation and 95 % interval."""

    value: float
    std: float
    interval95: tuple[float, float]


@dataclass(frozen=True, eq=False)
class HeldOutEnds:
    """End errors of windows of held-out drives, simulated minus measured, m/s.

    Nothing is fitted to the held-out drive: its start speeds and slope are measured, its load is as stated.

    Parameters
    ----------
    run : (n,) index of the window's drive. before : (n,) at the prior. after : (n,) with the extended model as fitted
        to all other drives.
    """

    run: NDArray[np.int64]
    before: Array
    after: Array

    def by_drive(self) -> tuple[Array, Array]:
        """Root mean square end error of each drive, before and after."""
        runs = np.unique(self.run)
        before, after = (np.sqrt([np.mean(e[self.run == u] ** 2) for u in runs]) for e in (self.before, self.after))
        return before, after

    def means(self) -> tuple[IntervalEstimate, IntervalEstimate]:
        """Mean end error over the drives, before and after."""
        runs = np.unique(self.run)
        before, after = (np.array([e[self.run == u].mean() for u in runs]) for e in (self.before, self.after))
        return over_drives(before), over_drives(after)

    def gain(self) -> IntervalEstimate:
        """Mean over the drives of the reduction of the rms end error, with an interval over drives."""
        before, after = self.by_drive()
        return over_drives(before - after)


@dataclass(frozen=True)
class SeasonalForce:
    """Drive force that holds 60 km/h in cold and in warm drives, separated at the widest gap of temperature; K, N."""

    cold: float
    warm: float
    in_cold: IntervalEstimate
    in_warm: IntervalEstimate
    more: IntervalEstimate


@dataclass(frozen=True, eq=False)
class RoadFindings:
    """Estimates of roads, accelerometer zeros and resistance from the drives.

    Parameters
    ----------
    names : of the drives; ``roads`` and ``zeros`` (m/s^2) have the same order.
    common_zero : the accelerometer's zero shared by all drives if it was estimated, else the mean over the drives.
    holding : by speed of HOLDING_KMH, the drive force (torque x ratio / radius) that holds it on a level road, N.
    seasons : cold against warm drives; None if all temperatures are similar.
    held_out : None with fewer than ``FEWEST_DRIVES`` drives.
    """

    names: tuple[str, ...]
    roads: tuple[RoadProfile, ...]
    zeros: tuple[IntervalEstimate, ...]
    common_zero: IntervalEstimate
    holding: Mapping[float, IntervalEstimate]
    seasons: SeasonalForce | None
    held_out: HeldOutEnds | None


def over_drives(each: Array) -> IntervalEstimate:
    """Mean of one value ``each`` (drives,) with an interval from the scatter of the drives; infinite for one drive."""
    if each.size < 2:
        return IntervalEstimate(float(each.mean()), float("inf"), (float("-inf"), float("inf")))
    std = float(each.std(ddof=1) / np.sqrt(each.size))
    half = t_quantile(each.size - 1.0) * std
    return IntervalEstimate(float(each.mean()), std, (float(each.mean()) - half, float(each.mean()) + half))


def road_findings(fit: FittedEffects, logs: Sequence[Log], roads: Sequence[RoadProfile]) -> RoadFindings:
    """The findings of a fit to windows grouped by drive.

    Parameters
    ----------
    fit : of the accepted effects. logs, roads : of every drive of the description.
    """
    setup, solution = fit.setup, fit.solution
    runs = _drives(setup)
    usual = float(np.mean([s.temperature for s in setup.segments]))
    used = tuple(roads[u] for u in runs)
    level = np.zeros(len(runs))
    slope, spread = (p.get(DRIVE_SLOPE, level) for p in (solution.per_run, solution.per_run_std))
    each = ((r.zero - GRAVITY * i, GRAVITY * s) for r, i, s in zip(used, slope, spread, strict=True))
    zeros = tuple(IntervalEstimate(value, std, normal_interval(value, std)) for value, std in each)
    shared = (solution.values[ZERO], solution.std[ZERO], solution.interval95[ZERO]) if ZERO in solution.names else None
    return RoadFindings(
        tuple(logs[u].name for u in runs),
        used,
        zeros,
        IntervalEstimate(*shared) if shared else over_drives(np.array([z.value for z in zeros])),
        {v: _combined(solution, *_holding(setup, solution, v / 3.6, usual)) for v in HOLDING_KMH},
        _seasons(setup, solution),
        _held_out(setup, fit.linearized) if len(runs) >= FEWEST_DRIVES else None,
    )


def _seasons(setup: SimulationSetup, solution: Solution) -> SeasonalForce | None:
    """The cold against the warm drives; None if all temperatures are similar."""
    each = np.sort([next(s.temperature for s in setup.segments if s.run == u) for u in _drives(setup)])
    gaps = np.diff(each)
    if not gaps.size or gaps.max() < LEAST_GAP:
        return None
    at = int(np.argmax(gaps)) + 1
    cold, warm = float(each[:at].mean()), float(each[at:].mean())
    (f, df), (g, dg) = (_holding(setup, solution, SEASON_KMH / 3.6, t) for t in (cold, warm))
    more = {n: df[n] - dg[n] for n in df}
    return SeasonalForce(
        cold, warm, _combined(solution, f, df), _combined(solution, g, dg), _combined(solution, f - g, more)
    )


def _combined(solution: Solution, value: float, slopes: Mapping[str, float]) -> IntervalEstimate:
    return IntervalEstimate(value, solution.std_of(slopes), solution.interval_of(value, slopes))


def _holding(
    setup: SimulationSetup, solution: Solution, speed: float, temperature: float
) -> tuple[float, dict[str, float]]:
    """Drive force, by the torque sensor, that holds a warm car's speed on a level road in still air, N; its gradient.

    T = T1 a(0) / (a(0) - a(T1)), force T i / r, with a(T) the acceleration at a torque T. The force includes driveline
    losses, so that mass and loss, which are nearly collinear in the drives, are not needed separately.
    """
    names = tuple(n for n in solution.names if n in (*setup.prior.names, *setup.added.names))
    values = {n: {**setup.prior.values, "wind_variance": 0.0}[n] for n in setup.model.parameters}
    simulator = Simulator(setup.model, values, names, setup.effects)
    context = {"heading": 0.0, "temperature": temperature, RUN_START: 0.0}
    moved = []
    for torque in (0.0, TEST_TORQUE):
        inputs = {**dict.fromkeys(setup.model.inputs, 0.0), "elapsed": WARM, "drive_torque": torque}
        inputs = {n: inputs[n] for n in setup.model.inputs}
        air = setup.point.car.inputs.air(temperature)
        drive = Drive(np.array([0.0, INSTANT]), inputs, {"speed": speed, "run_time": WARM}, air, context)
        one = simulator(drive, [solution.values[n] for n in names])
        moved.append((float(one.outputs["speed"][-1] - speed), one.sensitivities["speed"][-1]))
    (coasting, coast_slopes), (pulled, pull_slopes) = moved
    per_torque = setup.prior.values["gear_ratio"] / setup.prior.values["wheel_radius"]
    force = per_torque * TEST_TORQUE * coasting / (coasting - pulled)
    gradient = per_torque * TEST_TORQUE * (coasting * pull_slopes - pulled * coast_slopes) / (coasting - pulled) ** 2
    return force, dict(zip(names, gradient.tolist(), strict=True))


def _drives(setup: SimulationSetup) -> NDArray[np.int64]:
    return np.unique([s.run for s in setup.segments]).astype(np.int64)


def _held_out(setup: SimulationSetup, linearized: Regression) -> HeldOutEnds | None:
    """Every drive predicted by a fit to the others; None where such a fit fails."""
    drives = _drives(setup)
    sizes = {n for e in setup.effects for n in e.unknowns if n not in e.nominal}
    blank = replace(setup, added=setup.added.started_at(dict.fromkeys(sizes, 0.0)))
    known = dict(zip(setup.vector.shared, blank.vector.theta.tolist(), strict=True))
    before, after, owner = [], [], []
    for k, drive in enumerate(drives):
        try:
            others, _ = approach(linearized.of_runs([j for j in range(len(drives)) if j != k]), FIT_STEPS)
        except ResultError:
            return None
        for i, s in enumerate(setup.segments):
            if s.run == drive:
                owner.append(k)
                before.append(_end(setup, i, known))
                after.append(_end(setup, i, {**known, **others}))
    return HeldOutEnds(np.array(owner, dtype=np.int64), np.array(before), np.array(after))


def _end(setup: SimulationSetup, segment: int, values: Mapping[str, float]) -> float:
    """End error of a window from its measured start speed, m/s."""
    theta = np.r_[
        [values[n] for n in setup.vector.shared],
        setup.vector.start_speed(segment)[0],
        np.zeros(len(setup.vector.own) - 1),
    ]
    speed = setup.simulate(segment, theta, slopes=False).values["speed"]
    return float(speed[-1] - setup.segments[segment].end[0])
