"""What drives on open roads told once the model was extended: resistance, roads, accelerometer, and drives left out."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.inference import Regression, Rows, Solution, approach
from vdyn_cli.inference.intervals import t_quantile
from vdyn_cli.quantities.constants import GRAVITY
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.felt import DRIVE_SLOPE, Felt, felt
from vdyn_cli.steps.validate.joined import ZERO
from vdyn_cli.steps.validate.trial import Trial

Array = NDArray[np.float64]

KMH = (30.0, 60.0, 90.0, 120.0)  # at which the resistance is told
WARM = 7200.0  # s of driving, after which nothing warms up any more
INSTANT = 0.1  # s
SEASON_KMH, LEAST_GAP = 60.0, 8.0  # km/h, K
PULL = 20.0  # N m, any: the force is straight in the torque
STEPS = 8  # of a fit to all drives but one
FEWEST = 3  # drives of which one can be left out
NORMAL = 1.96


@dataclass(frozen=True)
class Sized:
    """A value with its standard deviation and 95 % interval."""

    value: float
    std: float
    interval95: tuple[float, float]


@dataclass(frozen=True, eq=False)
class HeldOut:
    """End errors of windows, simulated less measured, m/s: (n,) of the drive ``run`` (n,).

    ``before`` : with what was known. ``after`` : with the extended model as fitted to all other drives. Nothing is
    fitted to the drive itself: its start speeds and what its accelerometer felt are measured, its load is as stated.
    """

    run: NDArray[np.int64]
    before: Array
    after: Array

    def by_drive(self) -> tuple[Array, Array]:
        """Root mean square end error of each drive, before and after."""
        runs = np.unique(self.run)
        return tuple(np.sqrt([np.mean(e[self.run == u] ** 2) for u in runs]) for e in (self.before, self.after))  # type: ignore[return-value]

    def gain(self) -> Sized:
        """Mean over the drives of the fall of the rms end error, with an interval over drives."""
        before, after = self.by_drive()
        return over_drives(before - after)


@dataclass(frozen=True)
class Seasons:
    """Drive force that holds 60 km/h in the cold and in the warm drives, parted at the widest gap; K, N."""

    cold: float
    warm: float
    in_cold: Sized
    in_warm: Sized
    more: Sized


@dataclass(frozen=True, eq=False)
class Hills:
    """The findings.

    Parameters
    ----------
    names : of the drives, with ``roads`` and ``zeros`` (m/s^2) in their order.
    zero : mean over the drives of the accelerometer's zero.
    zero_shared : the zero that all drives share, where that was sought.
    holding : drive force (torque x ratio / radius) that holds each speed of KMH on the level, N.
    """

    names: tuple[str, ...]
    roads: tuple[Felt, ...]
    zeros: tuple[Sized, ...]
    zero: Sized
    zero_shared: Sized | None
    holding: Mapping[float, Sized]
    seasons: Seasons | None
    held_out: HeldOut | None


def over_drives(each: Array) -> Sized:
    """Mean with an interval from the scatter of the drives."""
    if each.size < 2:
        return Sized(float(each.mean()), float("inf"), (float("-inf"), float("inf")))
    std = float(each.std(ddof=1) / np.sqrt(each.size))
    half = t_quantile(each.size - 1.0) * std
    return Sized(float(each.mean()), std, (float(each.mean()) - half, float(each.mean()) + half))


def hills(trial: Trial, straight: Regression, solution: Solution, logs: Sequence[Log]) -> Hills:
    """What the fit of joined drives found.

    Parameters
    ----------
    trial : with its effects at their sizes. straight : the regression of its joined drives on straight lines.
    """
    runs = _drives(trial)
    usual = float(np.mean([s.temperature for s in trial.stretches]))
    roads = tuple(felt(logs[u]) for u in runs)
    level = np.zeros(len(runs))
    slope, spread = (p.get(DRIVE_SLOPE, level) for p in (solution.per_run, solution.per_run_std))
    zeros = tuple(_sized(r.zero - GRAVITY * i, GRAVITY * s) for r, i, s in zip(roads, slope, spread, strict=True))
    return Hills(
        tuple(logs[u].name for u in runs),
        roads,
        zeros,
        over_drives(np.array([z.value for z in zeros])),
        Sized(solution.values[ZERO], solution.std[ZERO], solution.interval95[ZERO]) if ZERO in solution.names else None,
        {v: _told(solution, *holding(trial, solution, v / 3.6, usual)) for v in KMH},
        seasons(trial, solution),
        held_out(trial, straight) if len(runs) >= FEWEST else None,
    )


def _sized(value: float, std: float) -> Sized:
    return Sized(value, std, (value - NORMAL * std, value + NORMAL * std))


def seasons(trial: Trial, solution: Solution) -> Seasons | None:
    """The cold against the warm, None where all drives were alike."""
    each = np.sort([next(s.temperature for s in trial.stretches if s.run == u) for u in _drives(trial)])
    gaps = np.diff(each)
    if not gaps.size or gaps.max() < LEAST_GAP:
        return None
    at = int(np.argmax(gaps)) + 1
    cold, warm = float(each[:at].mean()), float(each[at:].mean())
    (f, df), (g, dg) = (holding(trial, solution, SEASON_KMH / 3.6, t) for t in (cold, warm))
    more = {n: df[n] - dg[n] for n in df}
    return Seasons(cold, warm, _told(solution, f, df), _told(solution, g, dg), _told(solution, f - g, more))


def _told(solution: Solution, value: float, slopes: Mapping[str, float]) -> Sized:
    return Sized(value, solution.std_of(slopes), solution.interval_of(value, slopes))


def holding(trial: Trial, solution: Solution, speed: float, temperature: float) -> tuple[float, dict[str, float]]:
    """Drive force at the torque sensor that holds a warm car's speed on the level in still air, N, and its derivatives.

    T = T1 a(0) / (a(0) - a(T1)), force T i / r, with a the acceleration at a torque: what the driveline loses is in
    it, and mass and loss, which the drives can hardly tell apart, are not needed for it.
    """
    names = tuple(n for n in solution.names if n in (*trial.beliefs.names, *(u.name for u in trial.extra)))
    values = {n: {**trial.beliefs.values, "wind_variance": 0.0}[n] for n in trial.model.parameters}
    simulator = Simulator(trial.model, values, names, trial.effects)
    air = {} if trial.day is None else {"air_density": values["air_density"] * trial.day / temperature}
    context = {"heading": 0.0, "temperature": temperature}
    seen = []
    for torque in (0.0, PULL):
        inputs = {**dict.fromkeys(trial.model.inputs, 0.0), "elapsed": WARM, "run_time": WARM, "drive_torque": torque}
        inputs = {n: inputs[n] for n in trial.model.inputs}
        drive = Drive(np.array([0.0, INSTANT]), inputs, {"speed": speed}, air, context)
        one = simulator(drive, [solution.values[n] for n in names])
        seen.append((float(one.outputs["speed"][-1] - speed), one.sensitivities["speed"][-1]))
    (coasting, coast_slopes), (pulled, pull_slopes) = seen
    per_torque = trial.beliefs.values["gear_ratio"] / trial.beliefs.values["wheel_radius"]
    force = per_torque * PULL * coasting / (coasting - pulled)
    gradient = per_torque * PULL * (coasting * pull_slopes - pulled * coast_slopes) / (coasting - pulled) ** 2
    return force, dict(zip(names, gradient.tolist(), strict=True))


def _drives(trial: Trial) -> NDArray[np.int64]:
    return np.unique([s.run for s in trial.stretches]).astype(np.int64)


def held_out(trial: Trial, straight: Regression) -> HeldOut | None:
    """Every drive predicted from the others."""
    drives = _drives(trial)
    sizes = {n for e in trial.effects for n in e.unknowns if n not in e.nominal}
    blank = replace(trial, extra=tuple(replace(u, start=0.0) if u.name in sizes else u for u in trial.extra))
    known = dict(zip(trial.shared, blank.theta().tolist(), strict=True))
    before, after, owner = [], [], []
    for k, drive in enumerate(drives):
        try:
            others, _ = approach(_without(straight, k), STEPS)
        except ResultError:
            return None
        for i, s in enumerate(trial.stretches):
            if s.run == drive:
                owner.append(k)
                before.append(_end(trial, i, known))
                after.append(_end(trial, i, {**known, **others}))
    return HeldOut(np.array(owner, dtype=np.int64), np.array(before), np.array(after))


def _without(regression: Regression, run: int) -> Regression:
    others = [k for k in range(len(regression.runs)) if k != run]

    def rows(k: int, theta: Array) -> Rows:
        return regression.rows(others[k], theta)

    return replace(regression, runs=tuple(regression.runs[k] for k in others), rows=rows)


def _end(trial: Trial, stretch: int, values: Mapping[str, float]) -> float:
    """End error of a window from its measured start speed, m/s."""
    theta = np.r_[[values[n] for n in trial.shared], trial.begun(stretch)[0], np.zeros(len(trial.own) - 1)]
    speed = trial.simulate(stretch, theta, slopes=False).values["speed"]
    return float(speed[-1] - trial.stretches[stretch].end[0])
