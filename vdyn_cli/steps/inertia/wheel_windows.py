"""A wheel's inertia by the integral form: over short windows, Jw times the speed gained is the torque's impulse.

    Jw (om(t2) - om(t1)) = integral of the net torque from t1 to t2

The wheel's speed is never differentiated: noise of the derivative biases Jw low, by half at 1 kHz, and a smoothing
filter takes from the steps that carry the information. Over a quarter of a second the speed gained is a hundred times
the noise of its two readings. Where something else moves much as the wheel does (its mass with the car), what is left
to tell them apart may be no larger than that noise: the gains of speed are adjusted within it (total least squares).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Regression, Rows, Unknown, white_level
from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.physics.models.wheel_spin import INPUTS, LEVER, READINGS, WHEEL_SPIN

if TYPE_CHECKING:
    from vdyn_cli.engine.model_builder import Correction
    from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]
Index = NDArray[np.intp]
STANDSTILL = 1.0  # rad/s, below which friction takes any value


@dataclass(frozen=True)
class Windows:
    """One run cut into windows.

    Parameters
    ----------
    log : with INPUTS, without gaps in them (those filled lie in no window).
    first, last : (w,), index of each window's edges; a window's last sample is the next one's first unless samples
        were left out between.
    gained : (w,), rad/s, speed gained in each, as measured.
    spread : (w,), s, root of the sum of squares of the weights of the samples in each window's integral.
    torque_noise, speed_noise : levels of white noise of the net torque (N m) and the wheel's speed (rad/s).
    """

    log: Log
    first: Index
    last: Index
    gained: Array
    spread: Array
    torque_noise: float
    speed_noise: float

    @property
    def duration(self) -> Array:
        return np.asarray(self.log.time[self.last] - self.log.time[self.first])

    @property
    def middle(self) -> Array:
        return np.asarray((self.log.time[self.last] + self.log.time[self.first]) / 2)

    def factor(self, inertia: float) -> Array:
        """Banded Cholesky factor, (2, w), of the covariance of the windows' impulses, (N m s)^2.

        Neighbours share one reading of the speed, whose error enters them with opposite signs.
        """
        shared = (inertia * self.speed_noise) ** 2
        band = np.zeros((2, self.first.size))
        band[0] = (self.torque_noise * self.spread) ** 2 + 2 * shared
        band[1, :-1] = np.where(self._neighbours, -shared, 0.0)
        return factored(band)

    @property
    def _neighbours(self) -> NDArray[np.bool_]:
        return np.asarray(self.last[:-1] == self.first[1:])

    def adjustment(self, weighed: Array) -> Array:
        """Covariance of the speeds gained, (rad/s)^2, times a vector, both (w,)."""
        beside = np.where(self._neighbours, 1.0, 0.0)
        total = 2 * weighed
        total[:-1] -= beside * weighed[1:]
        total[1:] -= beside * weighed[:-1]
        return np.asarray(self.speed_noise**2 * total)


def cut(log: Log, width: float, known: Mapping[str, float]) -> Windows:
    """Cut a run into windows of about ``width`` s, leaving out gaps, missing values and standstill.

    Parameters
    ----------
    known : wheel_mass, wheel_radius, rolling_resistance.
    """
    time, speed = log.time, log["wheel_speed"]
    good = np.all([np.isfinite(log[name]) for name in INPUTS], axis=0) & (np.abs(speed) > STANDSTILL)
    step = float(np.median(np.diff(time))) if time.size > 1 else 1.0
    whole = good[1:] & good[:-1] & (np.diff(time) < 5 * step)  # intervals that may be integrated
    count = max(round(width / step), 2)
    first, last = _edges(whole, count)
    filled = {n: np.interp(time, time[good], log[n][good]) if good.any() else np.zeros(time.size) for n in INPUTS}
    log = log.with_channels(**filled)
    if first.size == 0:
        empty = np.zeros(0)
        return Windows(log, first, last, empty, empty, 1.0, 1.0)
    torque = _net_torque(log, known)
    weight = np.convolve(np.diff(time), [0.5, 0.5])
    squares = np.concatenate([[0.0], np.cumsum(weight**2)])
    return Windows(
        log,
        first,
        last,
        np.asarray(log["wheel_speed"][last] - log["wheel_speed"][first]),
        np.sqrt(squares[last] - squares[first]),
        white_level(torque[good], time[good]),
        white_level(speed[good], time[good]),
    )


def _edges(whole: NDArray[np.bool_], count: int) -> tuple[Index, Index]:
    """First and last samples of windows of ``count`` intervals inside every stretch of whole intervals."""
    change = np.flatnonzero(np.diff(np.concatenate([[False], whole, [False]])))
    first: list[int] = []
    last: list[int] = []
    for begin, end in zip(change[::2], change[1::2], strict=True):  # intervals begin .. end - 1
        edges = np.arange(begin, end + 1, count)
        first += edges[:-1].tolist()
        last += edges[1:].tolist()
    return np.array(first, dtype=np.intp), np.array(last, dtype=np.intp)


def _net_torque(log: Log, known: Mapping[str, float]) -> Array:
    """The torque that speeds the wheel up, roughly: for the level of its noise and a start value."""
    force = log["hub_force_x"] + known["wheel_mass"] * log["acceleration"]
    return log["hub_torque"] - known["wheel_radius"] * (force + known["rolling_resistance"] * log["hub_force_z"])


def start_value(runs: Sequence[Windows], known: Mapping[str, float]) -> float:
    """Inertia by plain least squares on window means, each run's zero removed."""
    above = below = 0.0
    for run in runs:
        torque = _net_torque(run.log, known)
        impulse = np.concatenate([[0.0], np.cumsum((torque[1:] + torque[:-1]) / 2 * np.diff(run.log.time))])
        mean = (impulse[run.last] - impulse[run.first]) / run.duration
        rate = run.gained / run.duration
        above += float(np.sum((rate - rate.mean()) * mean))
        below += float(np.sum((rate - rate.mean()) ** 2))
    return above / below


def regression(
    runs: Sequence[Windows],
    known: Mapping[str, float],
    zero: float,
    start: float,
    extra: Sequence[Unknown] = (),
    effects: Sequence[Correction] = (),
) -> Regression:
    """The wheel's inertia, shared, and each run's zero of the torque, within ``zero`` N m.

    Rows are the windows' impulses Jw (simulated less measured gain of speed), whitened by their covariance at that Jw::

        r = L^-1 R,    R = J (simulated - measured),    L L' = S_T + J^2 S_w,    J = (r0 / r) Jw

    with S_T and S_w those of the torque's impulses and of the gains of speed: total least squares. dr/dJ is taken with
    the gains adjusted within their noise, measured + J S_w S^-1 R, which gives the cost's own gradient and does not
    take noise for information. r0 is the stated radius, r the model's: where torque, radius and inertia are all in
    doubt, scaling all three changes nothing that was measured, and must not seem to make the residual smaller.

    Source: Fuller, Measurement Error Models (Wiley 1987), 1.3.

    ``extra`` are further shared unknowns of the model or of ``effects``.
    """
    unknowns = (
        Unknown("wheel_inertia", start, 0.01 * start, 100 * start, "kg m^2"),
        *extra,
        Unknown("hub_torque_zero", 0.0, -50 * zero, 50 * zero, "N m", (0.0, zero), per_run=True, nuisance=True),
    )
    values = {**known, "wheel_inertia": start, "hub_torque_zero": 0.0}
    simulator = Simulator(WHEEL_SPIN, values, [u.name for u in unknowns], effects)
    drives = [Drive(run.log.time, {name: run.log[name] for name in INPUTS}) for run in runs]

    def rows(index: int, theta: Array) -> Rows:
        run, simulated = runs[index], simulator(drives[index], theta)
        trace = np.sum([simulated.outputs[name] for name in READINGS], axis=0)
        tangents = np.sum([simulated.sensitivities[name] for name in READINGS], axis=0)
        excess = trace[run.last] - trace[run.first] - run.gained
        slopes = theta[0] * (tangents[run.last] - tangents[run.first])
        slopes[:, 0] += excess
        lever = float(simulated.outputs[LEVER][0])
        longer = simulated.sensitivities[LEVER][0] / lever
        slopes -= np.outer(theta[0] * excess, longer)
        inertia, scale = theta[0] * known["wheel_radius"] / lever, known["wheel_radius"] / lever
        factor = run.factor(inertia)
        residual = whitened(factor, theta[0] * excess * scale)
        larger = -inertia * longer  # d J / d unknown
        larger[0] += scale
        slopes = slopes * scale - np.outer(inertia * run.adjustment(weighed(factor, residual)), larger)
        return Rows(residual, whitened(factor, slopes), time=run.middle)

    return Regression(unknowns, tuple(run.log.name for run in runs), rows)


def slopes_to(
    names: Sequence[str],
    runs: Sequence[Windows],
    known: Mapping[str, float],
    zero: float,
    shared: Sequence[float],
    zeros: Array,
    extra: Sequence[Unknown] = (),
    effects: Sequence[Correction] = (),
) -> dict[str, float]:
    """How the estimated inertia moves with what was taken as known: d Jw / d known.

    The minimum follows a known p as d theta / dp = -(J'J)^-1 J' dr/dp, J with the priors' rows.

    Parameters
    ----------
    names : parameters of the model.
    shared, zeros : the solution: inertia and ``extra``, and each run's zero. effects : those that it had.
    """
    given = [Unknown(name, known[name]) for name in names]
    extended = regression(runs, known, zero, shared[0], (*extra, *given), effects)
    s, size = len(shared), len(shared) + len(runs)
    normal, right = np.zeros((size, size)), np.zeros((size, len(names)))
    for k in range(len(runs)):
        theta = np.array([*shared, *(known[n] for n in names), zeros[k]])
        jacobian = extended.rows(k, theta).jacobian
        own = np.zeros((len(jacobian), size))
        own[:, :s], own[:, s + k] = jacobian[:, :s], jacobian[:, -1]
        normal += own.T @ own
        normal[s + k, s + k] += zero**-2.0
        right += own.T @ jacobian[:, s:-1]
    scale = 1.0 / np.sqrt(np.diag(normal))
    moved = -scale[:, None] * np.linalg.solve(normal * np.outer(scale, scale), scale[:, None] * right)
    return dict(zip(names, moved[0].tolist(), strict=True))
