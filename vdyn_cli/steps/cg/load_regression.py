"""The moment balance fitted with noise in every channel, and without differentiating the pitch rate."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from operator import attrgetter

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.engine.model_builder import Correction, Law, Number, Signals
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve
from vdyn_cli.inference.banded import factored, weighed, whitened
from vdyn_cli.physics.models.load_transfer import FRONT_LOAD_TRANSFER, LOAD_TRANSFER, MOMENTS, SOUGHT, UNIT
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.cg.windows import Windows

Array = NDArray[np.float64]

SMOOTHING = 0.015  # s, standard deviation: passes what the body does and stops the sensors' noise
# s to either side, over which a load's second derivative is taken. The true channels', by which unknowns are moved,
# takes longer: its noise, which comes from the same readings as the balance's, would draw what they find to zero.
BEND, WIDE_BEND = 0.06, 0.12
MOST_ROUNDS = 12
CLOSE = 1e-8  # of one residual's variance that a further step may still promise


@dataclass(frozen=True)
class Channels:
    """One run's channels, (n,) each, as drives of the balance: without pitch acceleration, and with 1 rad/s^2."""

    still: Drive
    turning: Drive
    pitch_rate: Array


@dataclass(frozen=True)
class Fixed:
    """One run about some values of its unknowns: what is not taken anew when they move.

    Parameters
    ----------
    true : the channels as the run's unknowns make them most probable, smoothed, ready to be simulated.
    factor : (2, k) banded Cholesky factor of the covariance of the integrated balances.
    residual : (k,) whitened balances of the channels as read.
    expected : (k,) balances of the true channels.
    """

    true: Channels
    factor: Array
    residual: Array
    expected: Array

    def whiten(self, values: Array) -> Array:
        return whitened(self.factor, values)


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
    effects, extra : candidate causes that correct the balance, and their unknowns, shared by all runs.
    """

    def __init__(
        self,
        runs: Sequence[Windows],
        given: Mapping[str, float],
        start: Mapping[str, float],
        zeros: Mapping[str, float],
        ranges: Mapping[str, tuple[float, float]],
        effects: Sequence[Correction] = (),
        extra: Sequence[Unknown] = (),
    ) -> None:
        self.runs, self.zeros = tuple(runs), dict(zeros)
        both = "rear_load" in runs[0].channels
        self._model = LOAD_TRANSFER if both else FRONT_LOAD_TRANSFER
        self._loads = ("front_load", "rear_load") if both else ("front_load",)
        shifts = tuple(f"{n}_zero" for n in (*self._loads, "acceleration"))
        self.unknowns = (
            *(Unknown(n, start[n], *ranges[n]) for n in SOUGHT),
            *extra,
            *(Unknown(n, 0.0, prior=(0.0, s), per_run=True, nuisance=True) for n, s in zeros.items() if s > 0),
        )
        self._names = tuple(dict.fromkeys((*(u.name for u in self.unknowns), *shifts)))
        values = {**given, **start, **dict.fromkeys(shifts, 0.0)}
        self._effects = tuple(effects)
        self._simulator = Simulator(self._model, values, self._names, effects)
        self._read = [self._channels(w, w.channels, BEND) for w in self.runs]

    def solve(self) -> Solution:
        """Fit, taking noise and true channels anew until the unknowns no longer move.

        Raises
        ------
        ResultError : the fit's own, or the balance does not settle.
        """
        at = self.start()
        for _ in range(MOST_ROUNDS):
            solution = solve(self.regression(at), tolerance=CLOSE)
            later = self.place(solution)
            scale = np.concatenate([list(solution.std.values()), np.full(later.size - len(solution.names), np.inf)])
            moved, at = float(np.max(np.abs(later - at) / scale)), later
            if moved < 1e-3:
                return solution
        raise ResultError(Finding("fit", "the moment balance does not settle", remedy="check units and signs"))

    def rough(self) -> Solution:
        """The fit before noise and true channels are taken anew: where a search may begin.

        Raises
        ------
        ResultError : the fit's own.
        """
        return solve(self.regression(self.start()), tolerance=CLOSE)

    def start(self) -> Array:
        """All unknowns where the search begins, shared first, then run by run."""
        own = [u.start for u in self.unknowns if u.per_run]
        return np.array([*(u.start for u in self.unknowns if not u.per_run), *own * len(self.runs)])

    def place(self, solution: Solution) -> Array:
        """All unknowns at a solution of this fit, or of one without its effects: those are at their starts."""
        shared = [solution.values.get(u.name, u.start) for u in self.unknowns if not u.per_run]
        own = np.array([solution.per_run[u.name] for u in self.unknowns if u.per_run])
        return np.concatenate([shared, own.T.ravel()])

    def regression(self, at: Array, start: Array | None = None) -> Regression:
        """The regression over all runs, noise and true channels as they are ``at`` these unknowns.

        It begins at ``start``, or there.

        r(theta) = L^-1 (g(theta_0; read) + g(theta; true) - g(theta_0; true)),   J = dr/dtheta

        g the integrated balances, theta_0 = ``at``, L L' the covariance of g there. The true channels are uncorrelated
        with the balances of the read ones (hence no bias), and smoothed: their own noise would only scatter the result.
        """
        s = sum(not u.per_run for u in self.unknowns)
        m = len(self.unknowns) - s
        local = [np.concatenate([at[:s], at[s + k * m : s + (k + 1) * m]]) for k in range(len(self.runs))]
        fixed = [self._fix(run, theta) for run, theta in enumerate(local)]

        def rows(run: int, theta: Array) -> Rows:
            windows, here = self.runs[run], fixed[run]
            balance, slopes = self._balance(windows, here.true, theta)
            residual = here.residual + here.whiten(balance - here.expected)
            return Rows(residual, here.whiten(slopes[:, : theta.size]), time=windows.middle)

        begin = at if start is None else start
        starts = {u.name: begin[s + i :: m] for i, u in enumerate(u for u in self.unknowns if u.per_run)}
        return Regression(self._begun(begin[:s]), tuple(w.run for w in self.runs), rows, starts)

    def _begun(self, shared: Array) -> tuple[Unknown, ...]:
        """The unknowns, the shared ones starting at given values."""
        begun = iter(shared.tolist())
        return tuple(u if u.per_run else replace(u, start=next(begun)) for u in self.unknowns)

    def _fix(self, run: int, theta: Array) -> Fixed:
        windows = self.runs[run]
        balance, slopes = self._balance(windows, self._read[run], theta)
        partial = self._partials(slopes, windows)
        factor = factored(self._covariance(windows, partial))
        residual = whitened(factor, balance)
        pull = weighed(factor, residual)
        smooth = {
            n: _smooth(v, windows.step)
            for n, v in self._true_channels(windows, partial, pull, self._late(theta)).items()
        }
        true = self._channels(windows, smooth, WIDE_BEND)
        return Fixed(true, factor, residual, self._balance(windows, true, theta)[0])

    def balance(self, run: int, theta: Array) -> tuple[Array, Array]:
        """(k,) N: each window's mean imbalance as front axle load, and its standard deviation from the noise."""
        windows = self.runs[run]
        balance, slopes = self._balance(windows, self._read[run], theta)
        partial = self._partials(slopes, windows)
        scale = partial["front_load"] * windows.width
        return balance / scale, np.sqrt(self._covariance(windows, partial)[0]) / np.abs(scale)

    def _channels(self, windows: Windows, values: Mapping[str, Array], reach: float) -> Channels:
        """Channels with the second derivatives of the loads, taken over ``reach`` s to either side."""
        inputs = {n: values[n] for n in (*self._loads, "acceleration", "pitch_rate", "pitch")}
        inputs["speed"] = values.get("speed", np.zeros_like(windows.time))
        inputs |= {f"{n}_bend": _bend(values[n], windows.step, reach) for n in self._loads}
        context = {"heading": windows.heading}
        still, turning = (
            Drive(windows.time, {**inputs, "pitch_acceleration": rate}, context=context) for rate in (0.0, 1.0)
        )
        return Channels(still, turning, values["pitch_rate"])

    def _balance(self, windows: Windows, channels: Channels, theta: Array) -> tuple[Array, Array]:
        """(k,) integrated balances and (k, j) their derivatives to all names, at the given channels."""
        values = np.zeros(len(self._names))
        values[: theta.size] = theta
        still, turning = (self._simulator(drive, values) for drive in (channels.still, channels.turning))
        change = windows.change(channels.pitch_rate)

        def integrated(quiet: Array, moving: Array) -> Array:
            # The balance is linear in the pitch acceleration, whose integral is the change of the pitch rate.
            per_rate = windows.integral(moving - quiet) / windows.width.reshape(-1, *[1] * (quiet.ndim - 1))
            return windows.integral(quiet) + per_rate * change.reshape(-1, *[1] * (quiet.ndim - 1))

        loads, motion = MOMENTS
        quiet, moving = (s.outputs[loads] + s.outputs[motion] for s in (still, turning))
        balance = integrated(quiet, moving)
        slopes = integrated(*(s.sensitivities[loads] + s.sensitivities[motion] for s in (still, turning)))
        per_rate = windows.integral(moving - quiet) / windows.width
        # By newtons read: where loads and all else are scaled alike nothing is nearer to what was measured.
        unit = float(still.outputs[UNIT][0])
        slopes = slopes - np.outer(balance, still.sensitivities[UNIT][0] / unit)
        return balance / unit, np.column_stack([slopes, per_rate]) / unit

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

    def _late(self, theta: Array) -> float:
        """By how much the loads are logged late at these unknowns, s."""
        values = dict(zip(self._names, theta.tolist(), strict=False))
        clock: Law = attrgetter("value")
        for effect in self._effects:
            if (law := effect.laws.get(f"{MOMENTS[0]}_clock")) is not None:
                own = {n: values.get(n, effect.nominal.get(n, 0.0)) for n in effect.unknowns}
                clock = _corrected(law, clock, Signals(**own))
        return float(clock(Signals(value=0.0)))

    def _true_channels(
        self, windows: Windows, slopes: Mapping[str, Array], pull: Array, late: float
    ) -> dict[str, Array]:
        """The channels that fulfil the balance and are most probable given the measured ones."""
        true = dict(windows.channels)
        for name in (*self._loads, "acceleration"):
            change = windows.noise[name] ** 2 * windows.spread(slopes[name] * pull)
            if name in self._loads and late:  # the reading that entered the balance was taken that much later
                change = np.interp(windows.time - late, windows.time, change, 0.0, 0.0)
            true[name] = true[name] - change
        push = np.zeros(windows.time.size)
        np.add.at(push, windows.first + windows.weights.shape[1] - 1, slopes["pitch_rate"] * pull)
        np.add.at(push, windows.first, -slopes["pitch_rate"] * pull)
        true["pitch_rate"] = true["pitch_rate"] - windows.noise["pitch_rate"] ** 2 * push
        return true


def _smooth(values: Array, step: float) -> Array:
    """A Gaussian average over SMOOTHING seconds."""
    from scipy.ndimage import gaussian_filter1d

    return np.asarray(gaussian_filter1d(values, SMOOTHING / step, mode="nearest"))


def _bend(values: Array, step: float, reach: float) -> Array:
    """Second derivative of the quintic through ``reach`` s to either side; with 0.06 s it is good up to some 5 Hz."""
    half = max(round(reach / step), 3)
    width = 2 * half + 1
    if values.size < width:
        return np.zeros_like(values)
    x = np.linspace(-1.0, 1.0, width)
    quintic = np.linalg.pinv(np.vander(x, 6, increasing=True))  # coefficients of a window's values
    per_step = (half * step) ** -2
    inner = np.correlate(values, 2 * per_step * quintic[2], "valid")
    bends = np.column_stack([k * (k - 1) * x ** max(k - 2, 0) for k in range(6)]) * per_step @ quintic
    first, last = bends[:half] @ values[:width], bends[half + 1 :] @ values[-width:]
    return np.asarray(np.concatenate([first, inner, last]))


def _corrected(law: Callable[[Law, Signals, Signals], Number], inner: Law, q: Signals) -> Law:
    return lambda s: law(inner, s, q)
