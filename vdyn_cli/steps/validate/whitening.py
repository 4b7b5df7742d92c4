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
from vdyn_cli.steps.validate.input_torque import LEAST_TORQUE, TORQUES
from vdyn_cli.steps.validate.residual_rows import FINEST, Prewhitener, RowLayout, prewhitener, row_layout
from vdyn_cli.steps.validate.segments import DriveSegment
from vdyn_cli.steps.validate.shaft_oscillation import ShaftOscillation, shaft_oscillation
from vdyn_cli.steps.validate.simulation import SimulatedSegment, SimulationSetup

Array = NDArray[np.float64]

CALM_LAGS = 2
CALM = 0.25  # s of a fast row where shafts that swing are to be left aside
LAGS = 10  # fast rows by which the noise of the torque sensor is predicted
# Noise of fast rows over that of the sensors. Of swinging shafts thousands of rows tell, and the model is right to some
# per cent. What is calm bears less: measured with nothing hidden, sizes scatter 0.8 to 1.4 times as the sensors say.
CAUTION, CALM_CAUTION = 3.0, 1.5


@dataclass(frozen=True, eq=False)
class WhitenedDrives:
    """Drives with the noise of all their rows.

    Parameters
    ----------
    first : outcomes where the unknowns begin, with slopes.
    perturbed : (segments) what noise of the torque sensor's size does to every output.
    sizes : of the slow noise. factors : its Cholesky factors. prewhiteners : of the fast rows.
    oscillations : rows in which half-shafts swing, where fast rows are averaged over more than that.
    caution : noise that fast rows are reckoned with, over that of the sensors.
    """

    setup: SimulationSetup
    layouts: tuple[RowLayout, ...]
    first: tuple[SimulatedSegment, ...]
    perturbed: tuple[Mapping[str, Array], ...]
    torque_levels: tuple[float, ...]
    sizes: Mapping[str, float]
    factors: tuple[Array, ...]
    prewhiteners: tuple[Prewhitener, ...]
    oscillations: tuple[ShaftOscillation | None, ...]
    caution: float

    def start(self, run: int) -> Array:
        """Local unknowns of a segment where they begin."""
        return self.setup.vector.start(run)

    def error(self, run: int, outcome: SimulatedSegment) -> dict[str, Array]:
        """Simulated less measured, each (n,)."""
        s = self.setup.segments[run]
        return {n: outcome.values[n] - s.outputs[n] for n in self.setup.sensors.channels if n in s.outputs}

    def white(self, run: int, outcome: SimulatedSegment, start: float, slopes: bool = True) -> Rows:
        """The whitened rows of a segment."""
        rows = _rows(
            self.layouts[run],
            self.error(run, outcome),
            outcome.sensitivities if slopes else None,
            self.factors[run],
            self.prewhiteners[run],
            self.oscillations[run],
            self.caution,
        )
        return self._begun(run, rows, start)

    def _begun(self, run: int, rows: Rows, start: float) -> Rows:
        """With what is known of the start: a car at rest is at rest."""
        value, std = self.setup.vector.start_speed(run)
        first = np.zeros((1, rows.jacobian.shape[1]))
        if first.size:
            first[0, len(self.setup.vector.shared)] = 1.0 / std
        assert rows.time is not None
        return Rows(
            np.r_[rows.residual, (start - value) / std],
            np.vstack([rows.jacobian, first]),
            time=np.r_[rows.time, self.setup.segments[run].time[0]],
            plain=rows.plain,
            plain_root=self._with_start(rows, std),
        )

    def _with_start(self, rows: Rows, std: float) -> Array | None:
        """The noise of the speed, and what its measured start is uncertain by."""
        if rows.plain is None or rows.plain_root is None or not rows.plain[1].size:
            return rows.plain_root
        return np.column_stack([rows.plain_root, std * rows.plain[1][:, len(self.setup.vector.shared)]])

    def __call__(self, run: int, theta: Array) -> Rows:
        start = self.start(run)
        same = theta.shape == start.shape and np.array_equal(theta, start)
        try:
            outcome = self.first[run] if same else self.setup.simulate(run, theta)
        except ResultError as error:  # far off, a setup may be beyond what the step size bears
            raise ArithmeticError(str(error)) from error
        return self.white(run, outcome, float(theta[len(self.setup.vector.shared)]))

    @cached_property
    def regression(self) -> Regression:
        unknowns, starts = self.setup.vector.unknowns()
        return Regression(unknowns, tuple(s.name for s in self.setup.segments), self, starts)


def _rows(
    p: RowLayout,
    error: Mapping[str, Array],
    slopes: Mapping[str, Array] | None,
    factor: Array,
    prewhitener: Prewhitener,
    swing: ShaftOscillation | None,
    caution: float,
) -> Rows:
    """Errors and their derivatives side by side through the same linear maps."""
    both = {n: e[:, None] if slopes is None else np.column_stack([slopes[n], e]) for n, e in error.items()}
    slow, fast = p.slow(both), p.fast(both)
    residual, jacobian = whiten(slow[:, -1], slow[:, :-1], cholesky=factor)
    quick = prewhitener.white(fast, _part(p)) / caution
    width = quick.shape[1]
    flat = quick.reshape(-1, quick.shape[-1])
    times = np.repeat(_fast_time(p, prewhitener), width)
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


def _part(p: RowLayout) -> NDArray[np.int64]:
    return p.part[p.fine.first]


def _fast_time(p: RowLayout, prewhitener: Prewhitener) -> Array:
    lags, part = len(prewhitener.weights), _part(p)
    return np.asarray(p.fine.time[lags:][part[lags:] == part[: part.size - lags]])


def whiten_drives(setup: SimulationSetup, calm: bool = False) -> WhitenedDrives:
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
    count = range(len(setup.segments))
    blank = WhitenedDrives(setup, (), (), (), (), {}, (), (), (), CALM_CAUTION if calm else CAUTION)
    first = setup.first
    radius = setup.prior.values["wheel_radius"]
    layouts = tuple(
        row_layout(s, setup.sensors.channels, radius, outcome.values, finest)
        for s, outcome in zip(setup.segments, first, strict=True)
    )
    levels = tuple(_torque_level(setup.segments[k]) for k in count)
    blank = replace(blank, layouts=layouts, first=first, torque_levels=levels)
    found = _sizes(blank)
    values = setup.prior.values
    factors, prewhiteners, perturbed = [], [], setup.perturbed
    for k in count:
        slow = noise.slow_noise(setup.segments[k], layouts[k], layouts[k].bins, values, levels[k])
        factors.append(np.asarray(np.linalg.cholesky(slow.covariance(found) + 1e-14 * np.eye(slow.push.size))))
        prewhiteners.append(
            prewhitener(layouts[k].fast({n: v[:, None] for n, v in perturbed[k].items()})[:, :, 0], lags)
        )
    swinging = (
        calm and not setup.nondifferentiable_prior
    )  # when a gap is crossed is known too badly for what swings after it
    oscillations = tuple(_oscillation(setup, layouts[k], k, levels[k]) if swinging else None for k in count)
    return replace(
        blank,
        sizes=found,
        factors=tuple(factors),
        prewhiteners=tuple(prewhiteners),
        perturbed=perturbed,
        oscillations=oscillations,
    )


def _oscillation(setup: SimulationSetup, p: RowLayout, run: int, level: float) -> ShaftOscillation | None:
    return shaft_oscillation(
        setup.segments[run], p, setup.inputs.torques[run].denoised.values, setup.perturbed[run], level
    )


def _torque_level(s: DriveSegment) -> float:
    """N m of white noise in a sample of the torque."""
    names = [n for n in TORQUES if n in s.inputs]
    return max(float(np.hypot.reduce([white_level(s.inputs[n], s.time) for n in names])), LEAST_TORQUE)


def _sizes(w: WhitenedDrives) -> dict[str, float]:
    setup = w.setup
    k = len(setup.prior.names)
    shared = len(setup.vector.shared)
    off = np.array([setup.prior.values[n] for n in setup.prior.names]) - setup.vector.theta[:k]
    runs = []
    for run in range(len(setup.segments)):
        p, outcome = w.layouts[run], w.first[run]
        bins = noise.sizing_bins(p)
        error = w.error(run, outcome)
        slow = p.slow({n: np.column_stack([outcome.sensitivities[n], e]) for n, e in error.items()}, bins)
        jacobian, own = slow[:, :shared].copy(), slow[:, shared:-1]
        believed = slow[:, -1] + jacobian[:, :k] @ off
        jacobian[:, :k] = jacobian[:, :k] @ setup.prior.root  # in units in which the prior are independent
        covariance = noise.slow_noise(setup.segments[run], p, bins, setup.prior.values, w.torque_levels[run])
        runs.append(NoisyRun(believed, jacobian, own, covariance))
    known = np.array(
        [
            *np.ones(k),
            *(std**-2.0 for std in setup.sensors.gain_std.values()),
            *(1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in setup.extra),
        ]
    )
    return noise.sizes(runs, known)
