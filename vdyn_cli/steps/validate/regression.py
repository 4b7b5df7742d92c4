"""Drives as a regression: every uncertain parameter with what is known of it, rows of all measured outputs."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.inference import Regression, Rows, white_level, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate import noise
from vdyn_cli.steps.validate.drives import Stretch
from vdyn_cli.steps.validate.rows import FINEST, Colour, Plan, colour, plan
from vdyn_cli.steps.validate.swift import Swift, swift
from vdyn_cli.steps.validate.torque import LEAST_TORQUE, TORQUES
from vdyn_cli.steps.validate.trial import Outcome, Trial

Array = NDArray[np.float64]

CALM_LAGS = 2
CALM = 0.25  # s of a fast row where shafts that swing are to be left aside
LAGS = 10  # fast rows by which the noise of the torque sensor is predicted
# Noise of fast rows over that of the sensors. Of swinging shafts thousands of rows tell, and the model is right to some
# per cent. What is calm bears less: measured with nothing hidden, sizes scatter 0.8 to 1.4 times as the sensors say.
CAUTION, CALM_CAUTION = 3.0, 1.5


@dataclass(frozen=True, eq=False)
class Weighed:
    """Drives with the noise of all their rows.

    Parameters
    ----------
    first : outcomes where the unknowns begin, with slopes.
    shaken : (stretches) what noise of the torque sensor's size does to every output.
    sizes : of the slow noise. factors : its Cholesky factors. colours : of the fast rows.
    swifts : rows in which half-shafts swing, where fast rows are averaged over more than that.
    caution : noise that fast rows are reckoned with, over that of the sensors.
    """

    trial: Trial
    plans: tuple[Plan, ...]
    first: tuple[Outcome, ...]
    shaken: tuple[Mapping[str, Array], ...]
    torque_levels: tuple[float, ...]
    sizes: Mapping[str, float]
    factors: tuple[Array, ...]
    colours: tuple[Colour, ...]
    swifts: tuple[Swift | None, ...]
    caution: float

    def start(self, run: int) -> Array:
        """Local unknowns of a stretch where they begin."""
        return self.trial.start(run)

    def error(self, run: int, outcome: Outcome) -> dict[str, Array]:
        """Simulated less measured, each (n,)."""
        s = self.trial.stretches[run]
        return {n: outcome.values[n] - s.outputs[n] for n in self.trial.channels if n in s.outputs}

    def white(self, run: int, outcome: Outcome, start: float, slopes: bool = True) -> Rows:
        """The whitened rows of a stretch."""
        rows = _rows(
            self.plans[run],
            self.error(run, outcome),
            outcome.slopes if slopes else None,
            self.factors[run],
            self.colours[run],
            self.swifts[run],
            self.caution,
        )
        return self._begun(run, rows, start)

    def _begun(self, run: int, rows: Rows, start: float) -> Rows:
        """With what is known of the start: a car at rest is at rest."""
        value, std = self.trial.begun(run)
        first = np.zeros((1, rows.jacobian.shape[1]))
        if first.size:
            first[0, len(self.trial.shared)] = 1.0 / std
        assert rows.time is not None
        return Rows(
            np.r_[rows.residual, (start - value) / std],
            np.vstack([rows.jacobian, first]),
            time=np.r_[rows.time, self.trial.stretches[run].time[0]],
            plain=rows.plain,
            plain_root=self._with_start(rows, std),
        )

    def _with_start(self, rows: Rows, std: float) -> Array | None:
        """The noise of the speed, and what its measured start is uncertain by."""
        if rows.plain is None or rows.plain_root is None or not rows.plain[1].size:
            return rows.plain_root
        return np.column_stack([rows.plain_root, std * rows.plain[1][:, len(self.trial.shared)]])

    def __call__(self, run: int, theta: Array) -> Rows:
        start = self.start(run)
        same = theta.shape == start.shape and np.array_equal(theta, start)
        try:
            outcome = self.first[run] if same else self.trial.simulate(run, theta)
        except ResultError as error:  # far off, a trial may be beyond what the step size bears
            raise ArithmeticError(str(error)) from error
        return self.white(run, outcome, float(theta[len(self.trial.shared)]))

    @cached_property
    def regression(self) -> Regression:
        unknowns, starts = self.trial.unknowns()
        return Regression(unknowns, tuple(s.name for s in self.trial.stretches), self, starts)


def _rows(
    p: Plan,
    error: Mapping[str, Array],
    slopes: Mapping[str, Array] | None,
    factor: Array,
    shade: Colour,
    swing: Swift | None,
    caution: float,
) -> Rows:
    """Errors and their derivatives side by side through the same linear maps."""
    both = {n: e[:, None] if slopes is None else np.column_stack([slopes[n], e]) for n, e in error.items()}
    slow, fast = p.slow(both), p.fast(both)
    residual, jacobian = whiten(slow[:, -1], slow[:, :-1], cholesky=factor)
    quick = shade.white(fast, _part(p)) / caution
    width = quick.shape[1]
    flat = quick.reshape(-1, quick.shape[-1])
    times = np.repeat(_fast_time(p, shade), width)
    slow_times = np.tile(p.bins.time, 2 if p.felt else 1)
    if swing is not None:
        at, rows = swing.white(p, both)
        flat = np.vstack([flat, rows.reshape(-1, rows.shape[-1]) / caution])
        times = np.concatenate([times, np.repeat(at, rows.shape[1])])
    speed = p.bins.mean(both["speed"][p.keep]) if "speed" in both else slow[: p.bins.time.size]
    return Rows(
        np.concatenate([residual, flat[:, -1]]),
        np.vstack([jacobian, flat[:, :-1]]),
        time=np.concatenate([slow_times, times]),
        plain=(speed[:, -1], speed[:, :-1]),
        plain_root=factor[: len(speed), : len(speed)],  # of the common error of all speeds, which comes first
    )


def _part(p: Plan) -> NDArray[np.int64]:
    return p.part[p.fine.first]


def _fast_time(p: Plan, shade: Colour) -> Array:
    lags, part = len(shade.weights), _part(p)
    return np.asarray(p.fine.time[lags:][part[lags:] == part[: part.size - lags]])


def weigh(trial: Trial, calm: bool = False) -> Weighed:
    """Simulate where the unknowns begin and find the noise of every row, the fitted unknowns being reckoned with.

    Parameters
    ----------
    calm : average the fast rows over ``CALM``. The noise of the torque sensor shakes the simulated shafts as no real
        torque does, and whatever quiets them (more damping, more inertia) then seems to be asked for: sums of squares
        of such noise do not average out. What is slower than the shafts is free of that.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    finest, lags = (CALM, CALM_LAGS) if calm else (FINEST, LAGS)
    count = range(len(trial.stretches))
    blank = Weighed(trial, (), (), (), (), {}, (), (), (), CALM_CAUTION if calm else CAUTION)
    first = trial.first
    radius = trial.beliefs.values["wheel_radius"]
    plans = tuple(
        plan(s, trial.channels, radius, outcome.values, finest)
        for s, outcome in zip(trial.stretches, first, strict=True)
    )
    levels = tuple(_torque_level(trial.stretches[k]) for k in count)
    blank = replace(blank, plans=plans, first=first, torque_levels=levels)
    found = _sizes(blank)
    values = trial.beliefs.values
    factors, colours, shaken = [], [], trial.shaken
    for k in count:
        slow = noise.slow_noise(trial.stretches[k], plans[k], plans[k].bins, values, levels[k])
        factors.append(np.asarray(np.linalg.cholesky(slow.covariance(found) + 1e-14 * np.eye(slow.push.size))))
        colours.append(colour(plans[k].fast({n: v[:, None] for n, v in shaken[k].items()})[:, :, 0], lags))
    swinging = calm and not trial.carried_plays  # when a gap is crossed is known too badly for what swings after it
    swifts = tuple(_swift(trial, plans[k], k, levels[k]) if swinging else None for k in count)
    return replace(blank, sizes=found, factors=tuple(factors), colours=tuple(colours), shaken=shaken, swifts=swifts)


def _swift(trial: Trial, p: Plan, run: int, level: float) -> Swift | None:
    return swift(trial.stretches[run], p, trial.torques[run].calm.values, trial.shaken[run], level)


def _torque_level(s: Stretch) -> float:
    """N m of white noise in a sample of the torque."""
    names = [n for n in TORQUES if n in s.inputs]
    return max(float(np.hypot.reduce([white_level(s.inputs[n], s.time) for n in names])), LEAST_TORQUE)


def _sizes(w: Weighed) -> dict[str, float]:
    trial = w.trial
    k = len(trial.beliefs.names)
    shared = len(trial.shared)
    off = np.array([trial.beliefs.values[n] for n in trial.beliefs.names]) - trial.theta()[:k]
    runs = []
    for run in range(len(trial.stretches)):
        p, outcome = w.plans[run], w.first[run]
        bins = noise.sizing_bins(p)
        error = w.error(run, outcome)
        slow = p.slow({n: np.column_stack([outcome.slopes[n], e]) for n, e in error.items()}, bins)
        jacobian, own = slow[:, :shared].copy(), slow[:, shared:-1]
        believed = slow[:, -1] + jacobian[:, :k] @ off
        jacobian[:, :k] = jacobian[:, :k] @ trial.beliefs.root  # in units in which the beliefs are independent
        covariance = noise.slow_noise(trial.stretches[run], p, bins, trial.beliefs.values, w.torque_levels[run])
        runs.append(NoisyRun(believed, jacobian, own, covariance))
    known = np.array(
        [
            *np.ones(k),
            *(std**-2.0 for std in trial.instruments.values()),
            *(1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in trial.extra),
        ]
    )
    return noise.sizes(runs, known)
