"""The moment balance fitted with noise in every channel, and without differentiating the pitch rate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.bench import Correction
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.errors import Finding, ResultError
from vdyn_cli.fit import Regression, Rows, Solution, Unknown, solve, white_level
from vdyn_cli.log import Log
from vdyn_cli.models.load_transfer import FRONT_LOAD_TRANSFER, LOAD_TRANSFER, SOUGHT

Array = NDArray[np.float64]

WINDOW = 0.02  # s over which the balance is integrated; the body pitches at 1 to 3 Hz
SMOOTHING = 0.015  # s, standard deviation: passes what the body does and stops the sensors' noise


@dataclass(frozen=True)
class Windows:
    """One run's measured channels, and the integrals taken of them over windows that share their ends.

    Parameters
    ----------
    run : the log's name. time : (n,) s of the samples.
    channels : each (n,): front_load, [rear_load], acceleration, pitch_rate, speed.
    weights : (k, m + 1), Simpson's weights of each window's samples. first : (k,), index of its first sample.
    noise : of each channel, its white standard deviation.
    """

    run: str
    time: Array
    channels: Mapping[str, Array]
    weights: Array
    first: NDArray[np.int64]
    noise: Mapping[str, float]

    @property
    def middle(self) -> Array:
        """Middle of each window, s."""
        return np.asarray(self.time[self.first + self.weights.shape[1] // 2])

    @property
    def width(self) -> Array:
        """Length of each window, s."""
        return np.asarray(self.weights.sum(axis=1))

    def integral(self, values: Array) -> Array:
        """Integrals over the windows of a row of n samples, or of each column of (n, j)."""
        reach = self.first[:, None] + np.arange(self.weights.shape[1])
        return np.asarray(np.einsum("kw,kw...->k...", self.weights, values[reach]))

    def spread(self, values: Array) -> Array:
        """The transpose of :meth:`integral`: (k,) onto the n samples."""
        reach = self.first[:, None] + np.arange(self.weights.shape[1])
        result = np.zeros(self.time.size)
        np.add.at(result, reach, self.weights * values[:, None])
        return result

    def change(self, values: Array) -> Array:
        """Last less first sample of each window."""
        return np.asarray(values[self.first + self.weights.shape[1] - 1] - values[self.first])


def cut_windows(log: Log) -> Windows:
    """Cut a run into windows of some 20 ms; windows with a gap or a missing sample are left out."""
    names = [n for n in ("front_load", "rear_load", "acceleration", "pitch_rate", "speed") if n in log]
    channels = {n: log[n] for n in names}
    step = float(np.median(np.diff(log.time)))
    half = max(1, round(WINDOW / step / 2))
    first = np.arange(0, log.time.size - 2 * half, 2 * half)
    reach = first[:, None] + np.arange(2 * half + 1)
    gaps = np.diff(log.time[reach], axis=1)
    good = gaps.max(axis=1) < 3 * step
    for values in channels.values():
        good &= np.isfinite(values[reach]).all(axis=1)
    weights = _simpson(gaps[good])
    clean = {n: np.where(np.isfinite(v), v, 0.0) for n, v in channels.items()}
    noise = {n: white_level(v, log.time) for n, v in channels.items()}
    return Windows(log.name, log.time, clean, weights, first[good].astype(np.int64), noise)


def _simpson(gaps: Array) -> Array:
    """Weights of Simpson's rule on uneven samples, (k, 2 j + 1) for gaps (k, 2 j)."""
    weights = np.zeros((len(gaps), gaps.shape[1] + 1))
    for j in range(0, gaps.shape[1], 2):
        a, b = gaps[:, j], gaps[:, j + 1]
        sixth = (a + b) / 6
        weights[:, j] += sixth * (2 - b / a)
        weights[:, j + 1] += sixth * (a + b) ** 2 / (a * b)
        weights[:, j + 2] += sixth * (2 - a / b)
    return weights


class LoadFit:
    """Runs with axle loads, and the centre of gravity and pitch inertia sought from them.

    The balance is integrated over each window, so that the pitch acceleration enters as the change of the measured
    pitch rate: nothing is differentiated. Noise in loads, acceleration and pitch rate all enters the balance; the
    unknown true channels are eliminated (total least squares), since a fit that blames the loads alone biases the
    pitch inertia low.

    Parameters
    ----------
    given : the parameters that are not sought.
    zeros : standard deviation of each run's zero of the axle loads and accelerometer, by unknown's name.
    """

    def __init__(
        self,
        runs: Sequence[Windows],
        given: Mapping[str, float],
        start: Mapping[str, float],
        zeros: Mapping[str, float],
        ranges: Mapping[str, tuple[float, float]],
        effects: Sequence[Correction] = (),
        effect_unknowns: Sequence[Unknown] = (),
    ) -> None:
        self.runs, self.zeros = tuple(runs), dict(zeros)
        both = "rear_load" in runs[0].channels
        self._model = LOAD_TRANSFER if both else FRONT_LOAD_TRANSFER
        self._loads = ("front_load", "rear_load") if both else ("front_load",)
        shifts = tuple(f"{n}_zero" for n in (*self._loads, "acceleration"))
        self.unknowns = (
            *(Unknown(n, start[n], *ranges[n]) for n in SOUGHT),
            *effect_unknowns,
            *(Unknown(n, 0.0, prior=(0.0, s), per_run=True, nuisance=True) for n, s in zeros.items() if s > 0),
        )
        self._names = tuple(dict.fromkeys((*(u.name for u in self.unknowns), *shifts)))
        values = {**given, **start, **dict.fromkeys(shifts, 0.0)}
        self._simulator = Simulator(self._model, values, self._names, effects)

    def solve(self) -> Solution:
        """Fit, linearising anew until the unknowns no longer move.

        Raises
        ------
        ResultError : the fit's own, or the linearisation does not settle.
        """
        at = Regression(self.unknowns, tuple(w.run for w in self.runs), self.rows).start()
        for _ in range(12):
            solution = solve(self.regression(at))
            own = [solution.per_run[u.name] for u in self.unknowns if u.per_run]
            later = np.concatenate([list(solution.values.values()), np.array(own).T.ravel()])
            scale = np.concatenate([list(solution.std.values()), np.full(later.size - len(solution.names), np.inf)])
            moved, at = float(np.max(np.abs(later - at) / scale)), later
            if moved < 1e-3:
                return solution
        raise ResultError(Finding("fit", "the moment balance does not settle", remedy="check units and signs"))

    def regression(self, at: Array) -> Regression:
        """The regression over all runs, linear about ``at`` (all unknowns, shared first, then run by run)."""
        names = tuple(w.run for w in self.runs)
        whole = Regression(self.unknowns, names, self.rows)
        fixed = [(whole.local(at, run), self.rows(run, whole.local(at, run))) for run in range(len(self.runs))]

        def rows(run: int, theta: Array) -> Rows:
            local, there = fixed[run]
            return Rows(there.residual + there.jacobian @ (theta - local), there.jacobian, time=there.time)

        return Regression(self.unknowns, names, rows)

    def rows(self, run: int, theta: Array) -> Rows:
        """Whitened balances of one run, and the derivatives by which the unknowns are to be moved.

        Those are taken at the channels' most probable true values, whose errors are uncorrelated with the balances
        (hence no bias), and smoothed: their own noise would only scatter the result.
        """
        from scipy.linalg import cholesky_banded, solve_banded

        windows = self.runs[run]
        balance, slopes = self._balance(windows, windows.channels, theta)
        partial = self._partials(slopes, windows)
        band = cholesky_banded(self._covariance(windows, partial), lower=True)

        def whiten(values: Array) -> Array:
            return np.asarray(solve_banded((1, 0), band, values))

        residual = whiten(balance)
        pull = solve_banded((0, 1), _upper(band), residual)
        true = {n: _smooth(v, windows.time) for n, v in self._true_channels(windows, partial, pull).items()}
        _, slopes = self._balance(windows, true, theta)
        jacobian = whiten(slopes[:, : len(self.unknowns)])
        return Rows(residual, jacobian, time=windows.middle)

    def balance(self, run: int, theta: Array) -> tuple[Array, Array]:
        """(k,) N: each window's mean imbalance as front axle load, and its standard deviation from the noise."""
        windows = self.runs[run]
        balance, slopes = self._balance(windows, windows.channels, theta)
        partial = self._partials(slopes, windows)
        scale = partial["front_load"] * windows.width
        return balance / scale, np.sqrt(self._covariance(windows, partial)[0]) / np.abs(scale)

    def _balance(self, windows: Windows, channels: Mapping[str, Array], theta: Array) -> tuple[Array, Array]:
        """(k,) integrated balances and (k, j) their derivatives to all names, at the given channels."""
        values = np.zeros(len(self._names))
        values[: theta.size] = theta
        inputs = {n: channels[n] for n in (*self._loads, "acceleration", "pitch_rate")}
        inputs["speed"] = channels.get("speed", np.zeros_like(windows.time))
        still, turning = (
            self._simulator(Drive(windows.time, {**inputs, "pitch_acceleration": rate}), values) for rate in (0.0, 1.0)
        )
        change = windows.change(channels["pitch_rate"])

        def integrated(quiet: Array, moving: Array) -> Array:
            # The balance is linear in the pitch acceleration, whose integral is the change of the pitch rate.
            per_rate = windows.integral(moving - quiet) / windows.width.reshape(-1, *[1] * (quiet.ndim - 1))
            return windows.integral(quiet) + per_rate * change.reshape(-1, *[1] * (quiet.ndim - 1))

        quiet, moving = still.sensitivities["balance"], turning.sensitivities["balance"]
        balance = integrated(still.outputs["balance"], turning.outputs["balance"])
        slopes = integrated(quiet, moving)
        per_rate = windows.integral(turning.outputs["balance"] - still.outputs["balance"]) / windows.width
        return balance, np.column_stack([slopes, per_rate])

    def _partials(self, slopes: Array, windows: Windows) -> dict[str, Array]:
        """(k,) derivative of the mean balance to each channel, and to the pitch acceleration."""
        partial = {
            n: -slopes[:, self._names.index(f"{n}_zero")] / windows.width for n in (*self._loads, "acceleration")
        }
        return {**partial, "pitch_rate": slopes[:, -1]}

    def _covariance(self, windows: Windows, partial: Mapping[str, Array]) -> Array:
        """Lower band (2, k) of the covariance of the integrated balances; neighbours share one sample."""
        band = np.zeros((2, windows.first.size))
        adjacent = np.diff(windows.first) == windows.weights.shape[1] - 1
        inner = np.sum(windows.weights**2, axis=1)
        shared = windows.weights[:-1, -1] * windows.weights[1:, 0] * adjacent
        for name in (*self._loads, "acceleration"):
            p, variance = partial[name], windows.noise[name] ** 2
            band[0] += variance * p**2 * inner
            band[1, :-1] += variance * p[:-1] * p[1:] * shared
        p, variance = partial["pitch_rate"], windows.noise["pitch_rate"] ** 2
        band[0] += 2 * variance * p**2
        band[1, :-1] -= variance * p[:-1] * p[1:] * adjacent
        return band

    def _true_channels(self, windows: Windows, partial: Mapping[str, Array], pull: Array) -> dict[str, Array]:
        """The channels that fulfil the balance and are most probable given the measured ones."""
        true = dict(windows.channels)
        for name in (*self._loads, "acceleration"):
            true[name] = true[name] - windows.noise[name] ** 2 * windows.spread(partial[name] * pull)
        push = np.zeros(windows.time.size)
        np.add.at(push, windows.first + windows.weights.shape[1] - 1, partial["pitch_rate"] * pull)
        np.add.at(push, windows.first, -partial["pitch_rate"] * pull)
        true["pitch_rate"] = true["pitch_rate"] - windows.noise["pitch_rate"] ** 2 * push
        return true


def _smooth(values: Array, time: Array) -> Array:
    """A Gaussian average over SMOOTHING seconds."""
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, SMOOTHING / float(np.median(np.diff(time))), mode="nearest"))


def _upper(band: Array) -> Array:
    """The transposed factor in the banded form that back substitution wants."""
    upper = np.zeros_like(band)
    upper[0, 1:], upper[1] = band[1, :-1], band[0]
    return upper
