"""Drives as a regression: every uncertain parameter with its prior, and whitened rows of all measured outputs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from vdyn_cli.inference import Regression, Rows, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.steps.validate import noise
from vdyn_cli.steps.validate.car.simulation import SimulatedSegment, SimulationSetup
from vdyn_cli.steps.validate.car.start_speeds import with_read_starts
from vdyn_cli.steps.validate.drives.complete_inputs import DRIVE_TORQUES
from vdyn_cli.steps.validate.drives.input_torque import LEAST_TORQUE
from vdyn_cli.steps.validate.drives.segments import DriveSegment
from vdyn_cli.steps.validate.fit.residual_rows import FINEST, Prewhitener, RowLayout, prewhitener, row_layout
from vdyn_cli.steps.validate.fit.shaft_oscillation import ShaftOscillation, shaft_oscillation

FINE_LAGS, AVERAGED_LAGS = 10, 2  # number of fast rows from which the noise of the torque sensor is predicted
AVERAGING = 0.25  # s, length of a fast row that averages over oscillations of the half-shafts
# Assumed standard deviation of fast rows over that of their sensors. There are thousands of rows with oscillating
# shafts, but the model is accurate to a few percent only. Averaged rows need less: without hidden effects, estimates
# scatter by 0.8 to 1.4 times what the sensors' noise predicts.
CAUTION, AVERAGED_CAUTION = 3.0, 1.5
RIDGE = 1e-14  # m^2/s^2, added to a covariance so that it can be factored


@dataclass(frozen=True, eq=False)
class SegmentWhitening:
    """Converts the errors of one segment into rows of unit variance.

    Parameters
    ----------
    layout : the rows. torque_level : N m, white noise of a sample of the drive torque.
    factor : Cholesky factor of the slow rows' covariance. prewhitener : of the fast rows.
    oscillation : rows in which half-shafts oscillate, if the fast rows average over that; else None.
    caution : standard deviation of fast rows over that of their sensors.
    steady : (slow rows, sources), response to one standard deviation of the winds, slopes and forces that last for the
        whole drive (``steady_sources``), if they are not in the factor; else empty.
    """

    layout: RowLayout
    torque_level: float
    factor: Array
    prewhitener: Prewhitener
    oscillation: ShaftOscillation | None
    caution: float
    steady: Array
    steady_sources: tuple[str, ...]

    @cached_property
    def white_steady(self) -> Array:
        """``steady`` in the whitened slow rows."""
        return np.asarray(np.linalg.solve(self.factor, self.steady))

    def rows(self, error: Mapping[str, Array], slopes: Mapping[str, Array] | None) -> Rows:
        """Whitened rows of errors, each (n,), and of their derivatives, each (n, k), by the same linear maps."""
        p = self.layout
        both = {n: e[:, None] if slopes is None else np.column_stack([slopes[n], e]) for n, e in error.items()}
        speeds = p.speeds_of(both)
        slow, fast = p.slow(both, speeds=speeds), p.fast(both, speeds)
        residual, jacobian = whiten(slow[:, -1], slow[:, :-1], cholesky=self.factor)
        part = p.part[p.fine.first]
        quick = self.prewhitener.white(fast, part) / self.caution
        flat = quick.reshape(-1, quick.shape[-1])
        times = np.repeat(p.fine.time[self.prewhitener.whole(part)], quick.shape[1])
        if self.oscillation is not None:
            at, rows = self.oscillation.white(p, both)
            flat = np.vstack([flat, rows.reshape(-1, rows.shape[-1]) / self.caution])
            times = np.concatenate([times, np.repeat(at, rows.shape[1])])
        speed = p.bins.mean(speeds[p.speeds.index("speed")]) if "speed" in both else slow[: p.bins.time.size]
        return Rows(
            np.concatenate([residual, flat[:, -1]]),
            np.vstack([jacobian, flat[:, :-1]]),
            time=np.concatenate([np.tile(p.bins.time, 2 if p.force else 1), times]),
            plain=(speed[:, -1], speed[:, :-1]),
            plain_root=self.factor[: len(speed), : len(speed)],  # of the common error of all speeds, which comes first
        )


@dataclass(frozen=True, eq=False)
class WhitenedDrives:
    """Drives with the noise of all their rows.

    Parameters
    ----------
    setup : the simulation. whitenings : of each segment.
    sizes : by source, standard deviations and correlation times of the slow noise.
    """

    setup: SimulationSetup
    whitenings: tuple[SegmentWhitening, ...]
    sizes: Mapping[str, float]

    def slow_covariance(self, run: int) -> Array:
        """Covariance (n, n) of a segment's slow rows by gusts, winds, road and torque, without the sensors' noise."""
        one, values = self.whitenings[run], self.setup.prior.values
        slow = noise.slow_noise(self.setup.segments[run], one.layout, one.layout.bins, values, one.torque_level)
        return slow.covariance({**self.sizes, "speed_noise": 0.0, "acceleration_noise": 0.0})

    def white(self, run: int, outcome: SimulatedSegment, start: float, slopes: bool = True) -> Rows:
        """The whitened rows of a segment, followed by the row of its start speed ``start``, m/s."""
        vector, s = self.setup.vector, self.setup.segments[run]
        error = errors(self.setup, run, outcome)
        rows = self.whitenings[run].rows(error, outcome.sensitivities if slopes else None)
        value, std = vector.start_speed(run)
        first, place = np.zeros((1, rows.jacobian.shape[1])), len(vector.shared)
        root, off = rows.plain_root, start - value
        if value > 0.0:  # the measured start is a reading of the sensor; a car at rest is at rest
            off = float(outcome.values["speed"][0]) - value
            if first.size:
                first[0] = outcome.sensitivities["speed"][0] / std
        elif first.size:
            first[0, place] = 1.0 / std
        if root is not None and rows.plain is not None and rows.plain[1].size:
            root = np.column_stack([root, std * rows.plain[1][:, place]])  # the measured start's own noise
        return Rows(
            np.r_[rows.residual, off / std],
            np.vstack([rows.jacobian, first]),
            time=np.r_[rows.time, s.time[0]],
            plain=rows.plain,
            plain_root=root,
        )

    @cached_property
    def at_start(self) -> tuple[Rows, ...]:
        """The whitened rows of every segment at the start values."""
        setup, first = self.setup, self.setup.first
        return setup.each(lambda k: self.white(k, first[k], setup.vector.first_speed(k)))

    def __call__(self, run: int, theta: Array) -> Rows:
        """The whitened rows of a segment at its vector of unknowns.

        Raises
        ------
        ArithmeticError : the simulation is not finite there.
        """
        start = self.setup.vector.start(run)
        try:
            first = self.setup.first[run]
            if theta.shape == start.shape and np.array_equal(theta, start):
                return self.at_start[run]
            if self.setup.chord:
                values = self.setup.simulate(run, theta, slopes=False).values
                outcome = SimulatedSegment(values, first.sensitivities)
            else:
                outcome = self.setup.simulate(run, theta)
        except ResultError as error:  # far from the start values, the step may be too long
            raise ArithmeticError(str(error)) from error
        return self.white(run, outcome, float(theta[len(self.setup.vector.shared)]))

    @cached_property
    def regression(self) -> Regression:
        """All segments as a regression."""
        unknowns, starts = self.setup.vector.unknowns()
        names = tuple(s.name for s in self.setup.segments)
        log_noise = sum(float(np.sum(np.log(np.diag(one.factor)))) for one in self.whitenings)
        return Regression(unknowns, names, self, starts, log_noise=log_noise)


def errors(setup: SimulationSetup, run: int, outcome: SimulatedSegment) -> dict[str, Array]:
    """Simulated minus measured of every compared channel of a segment, each (n,).

    Parameters
    ----------
    run : index of the segment. outcome : its simulation.
    """
    measured = setup.segments[run].outputs
    return {n: outcome.values[n] - measured[n] for n in setup.sensors.channels if n in measured}


def whiten_drives(setup: SimulationSetup, averaged: bool = False, steady_apart: bool = False) -> WhitenedDrives:
    """Simulate at the start values and estimate the noise of every row, with all unknowns free.

    Parameters
    ----------
    averaged : average the fast rows over ``AVERAGING``, longer than an oscillation of the shafts. Otherwise the noise
        of the torque sensor, which excites the simulated shafts as no real torque does, biases a fit towards more
        damping and inertia, since the squares of such noise do not average out.
    steady_apart : exclude from the factor what lasts for a whole drive, and keep its response in ``steady``.

    Raises
    ------
    ResultError : the simulation is not finite.
    """
    finest, lags, caution = (AVERAGING, AVERAGED_LAGS, AVERAGED_CAUTION) if averaged else (FINEST, FINE_LAGS, CAUTION)
    setup = with_read_starts(setup)
    radius, values = setup.prior.values["wheel_radius"], setup.prior.values
    first, perturbed = setup.first, setup.perturbed
    layouts = tuple(
        row_layout(s, setup.sensors.channels, radius, outcome.values, finest)
        for s, outcome in zip(setup.segments, first, strict=True)
    )
    levels = tuple(_torque_level(s) for s in setup.segments)
    sizes = _noise_sizes(setup, layouts, levels)
    # With free play, the instants of impacts are too uncertain to fit the oscillation that follows.
    oscillating = averaged and not setup.point.car.known_play
    whitenings = []
    for k, (s, p, level) in enumerate(zip(setup.segments, layouts, levels, strict=True)):
        slow = noise.slow_noise(s, p, p.bins, values, level)
        lasting = slow.steady if steady_apart else {}
        covariance = slow.covariance({n: 0.0 if n in lasting else size for n, size in sizes.items()})
        factor = np.asarray(np.linalg.cholesky(covariance + RIDGE * np.eye(slow.push.size)))
        steady = np.array([sizes[n] * response for n, response in lasting.items()]).reshape(-1, slow.push.size).T
        sample = p.fast({n: v[:, None] for n, v in perturbed[k].items()})[:, :, 0]
        torques = setup.point.car.inputs.torques[k][0].values
        oscillation = shaft_oscillation(s, p, torques, perturbed[k], level) if oscillating else None
        whitenings.append(
            SegmentWhitening(p, level, factor, prewhitener(sample, lags), oscillation, caution, steady, tuple(lasting))
        )
    return WhitenedDrives(setup, tuple(whitenings), sizes)


def _torque_level(s: DriveSegment) -> float:
    """White noise of a sample of the drive torque, N m."""
    names = [n for n in DRIVE_TORQUES if n in s.inputs]
    return max(float(np.hypot.reduce([s.noise_levels[n] for n in names])), LEAST_TORQUE)


def _noise_sizes(setup: SimulationSetup, layouts: Sequence[RowLayout], levels: Sequence[float]) -> dict[str, float]:
    """The sizes of the slow noise, by restricted maximum likelihood."""
    prior, k, shared = setup.prior, len(setup.prior.names), len(setup.vector.shared)
    off = np.array([prior.values[n] for n in prior.names]) - setup.vector.theta[:k]
    runs = []
    for run, (s, p, level) in enumerate(zip(setup.segments, layouts, levels, strict=True)):
        bins, outcome = noise.sizing_bins(p), setup.first[run]
        error = errors(setup, run, outcome)
        slow = p.slow({n: np.column_stack([outcome.sensitivities[n], e]) for n, e in error.items()}, bins)
        jacobian, own = slow[:, :shared].copy(), slow[:, shared:-1]
        at_prior = slow[:, -1] + jacobian[:, :k] @ off
        jacobian[:, :k] = jacobian[:, :k] @ prior.root  # in units in which the prior is white
        runs.append(NoisyRun(at_prior, jacobian, own, noise.slow_noise(s, p, bins, prior.values, level)))
    gains = (std**-2.0 for std in setup.sensors.gain_std.values())
    effects = (1.0 / u.prior[1] ** 2 if u.prior else 0.0 for u in setup.added.unknowns)
    return noise.sizes(runs, np.array([*np.ones(k), *gains, *effects]), layouts)
