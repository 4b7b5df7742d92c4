"""The period of small oscillations from a recording, with decaying amplitude, sensor zero and a disturbance."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve, white_level
from vdyn_cli.inference.regression import stacked
from vdyn_cli.physics.models.pendulum import MODELS
from vdyn_cli.quantities.arrays import Array, rms
from vdyn_cli.quantities.errors import Finding, InputError, ResultError
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.step_policy import STEP_POLICY

if TYPE_CHECKING:
    from vdyn_cli.engine.model_builder import Correction
    from vdyn_cli.quantities.log import Log

ZEROS = {"angular_rate": "rate_zero", "angle": "angle_zero"}  # channels that can be fitted, the better one first
STARTS = ("start.angle", "start.angular_rate")
FEWEST_SAMPLES = 50  # twenty in each of the fewest periods
FEWEST_SWINGS = 2.5  # periods; with fewer, period, damping and zero are nearly collinear
LARGEST_SWING = 1.2  # rad; beyond it a knife edge lifts and cords go slack
# Friction in addition to viscous damping, with priors: over a few periods it is collinear with damping.
FRICTION = (
    Unknown("drag", 0.0, -1.0, 1.0, "1/rad", prior=(0.0, 0.05), nuisance=True),
    Unknown("friction", 0.0, -1.0, 1.0, "rad/s^2", prior=(0.0, 0.05), nuisance=True),
)
FADED = 0.25  # of the first amplitude; below it dry friction determines the motion rather than the period


@dataclass(frozen=True)
class Recording:
    """One channel of a free oscillation.

    Parameters
    ----------
    name : of the log. channel : "angle" (rad) or "angular_rate" (rad/s).
    time, values : (n,), without gaps in the values.
    kind, geometry : key of the pendulum in ``MODELS``, and further parameters of that model, by name.
    """

    name: str
    channel: str
    time: Array
    values: Array
    kind: str
    geometry: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, log: Log, kind: str, geometry: Mapping[str, float]) -> Recording:
        """The recording of a log's angular rate, else of its angle, without the samples that are NaN.

        Parameters
        ----------
        kind : key of ``MODELS``. geometry : further parameters of that model, SI.

        Raises
        ------
        InputError : the log has neither channel.
        """
        channel = next((name for name in ZEROS if name in log), None)
        if channel is None:
            raise InputError(Finding(log.name, f"has neither {' nor '.join(ZEROS)}", remedy="map one of them"))
        good = np.isfinite(log[channel])
        return cls(log.name, channel, log.time[good], log[channel][good], kind, geometry)

    def simulator(self, period: float, unknowns: Sequence[str], effects: Sequence[Correction]) -> Simulator:
        """The pendulum's simulator with a period (s); friction and zeros are 0 unless they are unknowns."""
        zeros = dict.fromkeys(("damping", "drag", "friction", "angle_zero", "rate_zero"), 0.0)
        values = {"period": period, **zeros, **self.geometry}
        return Simulator(MODELS[self.kind], values, unknowns, effects)


@dataclass(frozen=True)
class FreeSwing:
    """A recording prepared for its fit.

    Parameters
    ----------
    recording : the part in which the amplitude is large enough. guess : start values.
    noise : standard deviation of the channel's white noise.
    scale : standard deviation of the residuals of a fit with viscous friction only, at least that of the noise.
    jump : index of the sample at which the oscillation was disturbed; None where it was not.
    """

    recording: Recording
    guess: DecayingSine
    noise: float
    scale: float
    jump: int | None = None

    @property
    def parts(self) -> tuple[slice, ...]:
        """The samples of each undisturbed part."""
        return (slice(None),) if self.jump is None else (slice(0, self.jump), slice(self.jump, None))

    def regression(
        self,
        added: AddedEffects = NO_EFFECTS,
        friction: Sequence[Unknown] = FRICTION,
    ) -> Regression:
        """The regression of period (s), damping (1/s) and the sensor's zero, shared, and of each part's start.

        The residual is simulated minus measured channel over ``scale``. Its rows raise ArithmeticError where negative
        friction makes the simulation unstable.

        Parameters
        ----------
        friction : unknowns of the friction in addition to viscous damping.
        """
        recording, guess, parts = self.recording, self.guess, self.parts
        time, channel, period = recording.time, recording.channel, guess.period
        unknowns = (
            Unknown("period", period, 0.5 * period, 2 * period, "s"),
            Unknown("damping", guess.damping, -10 / period, 10 / period, "1/s", nuisance=True),
            Unknown(ZEROS[channel], guess.zero, nuisance=True),
            *friction,
            *added.unknowns,
            Unknown("start.angle", 0.0, -np.pi, np.pi, "rad", per_run=True, nuisance=True),
            Unknown("start.angular_rate", 0.0, -1e3, 1e3, "rad/s", per_run=True, nuisance=True),
        )
        simulator = recording.simulator(period, [u.name for u in unknowns], added.effects)
        drives = [Drive(time[part], {}) for part in parts]

        def rows(part: int, theta: Array) -> Rows:
            try:
                simulated = simulator(drives[part], theta)
            except ResultError as error:  # negative friction makes it unstable: the fit steps back
                raise ArithmeticError from error
            residual = simulated.outputs[channel] - recording.values[parts[part]]
            return Rows(residual / self.scale, simulated.sensitivities[channel] / self.scale, time=time[parts[part]])

        starts = np.array([guess.state(time[part][0]) for part in parts])
        names = tuple(f"{recording.name}, part {k + 1}" for k in range(len(parts)))
        return Regression(unknowns, names, rows, dict(zip(STARTS, starts.T, strict=True)))

    @cached_property
    def solution(self) -> Solution:
        """The fit without effects: period (s) and damping (1/s). Raises ResultError as ``solve``."""
        return solve(self.regression())

    @property
    def simulated(self) -> Array:
        """The fitted channel (n,) at the recording's times. Raises ResultError as ``solve``."""
        return np.asarray(self.recording.values + self.scale * np.concatenate(self.solution.residuals))

    @property
    def disturbances(self) -> tuple[float, ...]:
        """Times at which the recording was split, s."""
        return () if self.jump is None else (float(self.recording.time[self.jump]),)


def free_swing(recording: Recording) -> FreeSwing:
    """Find the oscillation in a recording, the scale of its residuals (rms with viscous friction alone), and a jump.

    Raises
    ------
    ResultError : no oscillation found, too short, or too wide.
    """
    recording, guess = _first_guess(recording)
    noise = white_level(recording.values, recording.time)
    # The residual with viscous friction alone is the scale for the residuals with other kinds of friction.
    viscous = FreeSwing(recording, guess, noise, noise)
    left = solve(viscous.regression(friction=())).residuals
    swing = replace(viscous, scale=noise * max(rms(*left), 1.0))
    jump = _jump(swing.regression(), swing.solution, recording.time)
    return swing if jump is None else replace(swing, jump=jump)


@dataclass(frozen=True)
class DecayingSine:
    """A decaying sine: angle(t) = exp(-damping t') (cosine cos + sine sin)(2 pi t' / period), t' since the start."""

    period: float
    damping: float
    zero: float
    start: float
    cosine: float
    sine: float

    def state(self, time: float) -> tuple[float, float]:
        """Angle (rad) and rate (rad/s) at a time (s)."""
        w, t = 2 * np.pi / self.period, time - self.start
        c, s, fade = np.cos(w * t), np.sin(w * t), np.exp(-self.damping * t)
        angle, rate = self.cosine * c + self.sine * s, w * (self.sine * c - self.cosine * s)
        return float(fade * angle), float(fade * rate)


def _first_guess(recording: Recording) -> tuple[Recording, DecayingSine]:
    """The part of the recording with a large enough amplitude, and the decaying sine that fits it best.

    Raises
    ------
    ResultError : there is none, it is too short, or the amplitude is too large.
    """
    name, remedy = recording.name, "record at least ten free swings"
    if recording.time.size < FEWEST_SAMPLES:
        what = f"the recording has {recording.time.size} samples: {FEWEST_SAMPLES} are needed"
        raise ResultError(Finding(name, what, "", remedy))
    frequency = _strongest(recording)
    early = recording.time <= _faded(recording, 1 / frequency)
    recording = replace(recording, time=recording.time[early], values=recording.values[early])
    frequency = _strongest(recording)
    (zero, cosine, sine), rest = _sine_fit(frequency, recording.time - recording.time[0], recording.values)
    if rest > 0.5 * float(np.var(recording.values)):
        raise ResultError(Finding(name, "the recording contains no free oscillation", "no clear period", remedy))
    swings = float(recording.time[-1] - recording.time[0]) * frequency
    if swings < FEWEST_SWINGS:
        what = f"the recording has {swings:.1f} swings of {1 / frequency:.3g} s: {FEWEST_SWINGS:g} are needed"
        raise ResultError(Finding(name, what, "", remedy))
    w = 2 * np.pi * frequency
    if recording.channel == "angular_rate":  # rate = w (sine cos - cosine sin)
        cosine, sine = -sine / w, cosine / w
    if np.hypot(cosine, sine) > LARGEST_SWING:
        got = f"{np.degrees(np.hypot(cosine, sine)):.0f} deg"
        remedy = "check the unit of the channel, or release at a smaller angle"
        raise ResultError(Finding(name, "the amplitude is too large for a pendulum", got, remedy))
    _, sizes = _amplitudes(recording, 1 / frequency)
    damping = -np.polyfit(np.arange(sizes.size) / frequency, np.log(np.maximum(sizes, 1e-12)), 1)[0]
    return recording, DecayingSine(1 / frequency, float(damping), zero, float(recording.time[0]), cosine, sine)


def _strongest(recording: Recording) -> float:
    """The frequency, 1/s, of the strongest sine: from the spectrum, refined on grids around its peak."""
    t, values = recording.time - recording.time[0], recording.values
    count = min(t.size, 4096)
    grid = np.linspace(t[0], t[-1], count)
    resampled = np.interp(grid, t, values)
    spectrum = np.abs(np.fft.rfft((resampled - resampled.mean()) * np.hanning(count), 4 * count))
    width: float = (count - 1) / (4 * count * float(t[-1]))
    peak = (1 + int(np.argmax(spectrum[1:]))) * width
    for _ in range(3):
        comb = peak + width * np.linspace(-2, 2, 17)
        comb = comb[comb > 0]
        peak = float(comb[int(np.argmin([_sine_fit(f, grid, resampled)[1] for f in comb]))])
        width /= 5
    return peak


def _sine_fit(frequency: float, t: Array, values: Array) -> tuple[tuple[float, float, float], float]:
    """Constant, cosine and sine coefficients at one frequency (1/s), and the residual variance."""
    phase = 2 * np.pi * frequency * t
    basis = np.column_stack([np.ones_like(t), np.cos(phase), np.sin(phase)])
    zero, cosine, sine = (float(x) for x in np.linalg.lstsq(basis, values, rcond=None)[0])
    left = values - basis @ np.array([zero, cosine, sine])
    return (zero, cosine, sine), float(np.mean(np.square(left)))


def _amplitudes(recording: Recording, period: float) -> tuple[Array, Array]:
    """Start (s) and standard deviation of each whole period."""
    turn = ((recording.time - recording.time[0]) / period).astype(int)
    swings = range(max(int(turn[-1]), 1))
    sizes = np.array([np.std(recording.values[turn == k]) for k in swings])
    return recording.time[0] + period * np.array(swings), sizes


def _faded(recording: Recording, period: float) -> float:
    """Time (s) from which the amplitude is so small that friction determines the motion."""
    starts, sizes = _amplitudes(recording, period)
    small = np.flatnonzero(sizes[3:] < FADED * sizes[0])
    return float(starts[3 + small[0]] if small.size else recording.time[-1])


def _jump(whole: Regression, solution: Solution, time: Array) -> int | None:
    """Index of the sample at which the oscillation was disturbed; None where no disturbance is significant.

    A disturbance at time tk adds a free oscillation exp(-D t) (c cos w t + s sin w t) from there on. The reduction of
    the sum of squares by the best tk, with all else refitted linearly, is divided by the remaining mean square and by
    the number of samples per independent one, because residuals of a real pendulum are correlated.
    """
    rows = whole.rows(0, stacked(whole.unknowns, solution.values, solution.per_run))
    basis = np.linalg.qr(rows.jacobian)[0]
    left = rows.residual - basis @ (basis.T @ rows.residual)
    t, period = time - time[0], solution.values["period"]
    phase, fade = 2 * np.pi * t / period, np.exp(-solution.values["damping"] * t)
    swing = np.column_stack([fade * np.cos(phase), fade * np.sin(phase)])

    square = _from_here_on(swing[:, :, None] * swing[:, None, :])
    across = _from_here_on(swing[:, :, None] * basis[:, None, :])
    shown = _from_here_on(swing * left[:, None])
    inside = np.flatnonzero((t > period / 2) & (t < t[-1] - period / 2))
    free = square[inside] - across[inside] @ across[inside].transpose(0, 2, 1)
    change = np.linalg.solve(free, shown[inside][:, :, None])[:, :, 0]
    gain = np.sum(change * shown[inside], axis=1)
    best = int(np.argmax(gain))
    jump = np.where(np.arange(t.size) >= inside[best], swing @ change[best], 0.0)
    rest = left - (jump - basis @ (basis.T @ jump))
    chi_square = float(gain[best]) / (float(np.mean(rest**2)) * _samples_per_independent_one(rest))
    return int(inside[best]) if chi_square > STEP_POLICY.pendulum_jump else None


def _from_here_on(products: Array) -> Array:
    """Sums over this and all later samples, along the first axis."""
    return np.asarray(np.cumsum(products[::-1], axis=0)[::-1])


def _samples_per_independent_one(residual: Array) -> float:
    """1 + 2 sum of the autocorrelation up to its first zero."""
    centered = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centered, 2 * centered.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: centered.size]
    first = int(np.argmax(correlation < 0)) or correlation.size
    return float(1 + 2 * np.sum(correlation[1:first]) / correlation[0])
