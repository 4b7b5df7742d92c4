"""The period of small swings from a recording: decaying amplitude, sensor zero, and a disturbance on the way."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np

from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.inference import Regression, Rows, Solution, Unknown, solve, white_level
from vdyn_cli.physics.models.pendulum import MODELS
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError
from vdyn_cli.steps.step_policy import STEP_POLICY

if TYPE_CHECKING:
    from vdyn_cli.engine.model_builder import Correction
    from vdyn_cli.quantities.log import Log

ZEROS = {"angular_rate": "rate_zero", "angle": "angle_zero"}  # channels that can be fitted, the better one first
STARTS = ("start.angle", "start.angular_rate")
FEWEST_SAMPLES = 50  # twenty in each of the fewest swings
FEWEST_SWINGS = 2.5  # fewer leave period, damping and zero nearly collinear
LARGEST_SWING = 1.2  # rad; beyond it a knife edge lifts and cords go slack
# Friction beyond the viscous one, with priors: in few swings it is collinear with damping.
FRICTION = (
    Unknown("drag", 0.0, -1.0, 1.0, "1/rad", prior=(0.0, 0.05), nuisance=True),
    Unknown("friction", 0.0, -1.0, 1.0, "rad/s^2", prior=(0.0, 0.05), nuisance=True),
)
FADED = 0.25  # of the first swing's amplitude; below it the swing shows dry friction rather than the period


@dataclass(frozen=True)
class Recording:
    """One channel of a free swing.

    Parameters
    ----------
    name : of the log. channel : "angle" (rad) or "angular_rate" (rad/s).
    time, values : (n,), without gaps in the values.
    kind, geometry : of the pendulum: a key of ``MODELS``, and further parameters of that model, by name.
    """

    name: str
    channel: str
    time: Array
    values: Array
    kind: str
    geometry: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, log: Log, kind: str, geometry: Mapping[str, float]) -> Recording:
        """The better channel of a log; ``kind`` and ``geometry`` as above."""
        channel = next(name for name in ZEROS if name in log)
        good = np.isfinite(log[channel])
        return cls(log.name, channel, log.time[good], log[channel][good], kind, geometry)

    def simulator(self, period: float, unknowns: Sequence[str], effects: Sequence[Correction] = ()) -> Simulator:
        """The swing's simulator about a period (s), without friction and zeros but those among the unknowns."""
        nothing = dict.fromkeys(("damping", "drag", "friction", "angle_zero", "rate_zero"), 0.0)
        values = {"period": period, **nothing, **self.geometry}
        return Simulator(MODELS[self.kind], values, unknowns, effects)


@dataclass(frozen=True)
class FittedSwing:
    """The fit to a recording.

    Parameters
    ----------
    recording : the part of it in which the wheel swings well.
    solution : of period (s) and damping (1/s), shared by all parts.
    simulated : (n,) at the recording's times. noise : standard deviation of the channel's white noise.
    disturbances : s, where the swing jumped and the recording was split.
    """

    recording: Recording
    solution: Solution
    simulated: Array
    noise: float
    disturbances: tuple[float, ...]


@dataclass(frozen=True)
class FreeSwing:
    """A recording ready for its fit.

    Parameters
    ----------
    recording : the part in which the wheel swings well. guess : a first one.
    scale : standard deviation of the residuals, noise and what viscous friction leaves.
    jump : the sample at which the swing was disturbed, if it was.
    """

    recording: Recording
    guess: DecayingSine
    scale: float
    jump: int | None = None

    @property
    def parts(self) -> tuple[slice, ...]:
        """The samples of each undisturbed swing."""
        return (slice(None),) if self.jump is None else (slice(0, self.jump), slice(self.jump, None))

    def regression(
        self,
        effects: Sequence[Correction] = (),
        extra: Sequence[Unknown] = (),
        friction: Sequence[Unknown] = FRICTION,
    ) -> Regression:
        """Period, damping and the sensor's zero shared, each part with a start of its own.

        Parameters
        ----------
        effects, extra : corrections of the swing's laws, and their unknowns.
        friction : unknowns of the friction beyond the viscous one.
        """
        recording, guess, parts = self.recording, self.guess, self.parts
        time, channel, period = recording.time, recording.channel, guess.period
        unknowns = (
            Unknown("period", period, 0.5 * period, 2 * period, "s"),
            Unknown("damping", guess.damping, -10 / period, 10 / period, "1/s", nuisance=True),
            Unknown(ZEROS[channel], guess.zero, nuisance=True),
            *friction,
            *extra,
            Unknown("start.angle", 0.0, -np.pi, np.pi, "rad", per_run=True, nuisance=True),
            Unknown("start.angular_rate", 0.0, -1e3, 1e3, "rad/s", per_run=True, nuisance=True),
        )
        simulator = recording.simulator(period, [u.name for u in unknowns], effects)
        drives = [Drive(time[part], {}) for part in parts]

        def rows(part: int, theta: Array) -> Rows:
            try:
                simulated = simulator(drives[part], theta)
            except ResultError as error:  # friction that drives the swing: the fit steps back
                raise ArithmeticError from error
            residual = simulated.outputs[channel] - recording.values[parts[part]]
            return Rows(residual / self.scale, simulated.sensitivities[channel] / self.scale, time=time[parts[part]])

        starts = np.array([guess.state(time[part][0]) for part in parts])
        names = tuple(f"{recording.name}, part {k + 1}" for k in range(len(parts)))
        return Regression(unknowns, names, rows, dict(zip(STARTS, starts.T, strict=True)))

    @cached_property
    def solution(self) -> Solution:
        """The fit without effects. Raises ResultError: the fit's own."""
        return solve(self.regression())

    def fit(self) -> FittedSwing:
        """Period and friction, with what they leave. Raises ResultError: the fit's own."""
        recording, solution = self.recording, self.solution
        simulated = recording.values + self.scale * np.concatenate(solution.residuals)
        noise = white_level(recording.values, recording.time)
        disturbances = () if self.jump is None else (float(recording.time[self.jump]),)
        return FittedSwing(recording, solution, simulated, noise, disturbances)


def free_swing(recording: Recording) -> FreeSwing:
    """Look for the swing, for the noise that viscous friction leaves of it, and for a disturbance.

    Raises
    ------
    ResultError : no swing to be seen, too short, or too wide.
    """
    recording, guess = _first_guess(recording)
    noise = white_level(recording.values, recording.time)
    # What viscous friction alone leaves is the scale against which the other kinds of friction are judged.
    viscous = FreeSwing(recording, guess, noise)
    left = solve(viscous.regression(friction=())).residuals[0]
    swing = replace(viscous, scale=max(noise, noise * float(np.sqrt(np.mean(left**2)))))
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
        """Angle and rate at a time."""
        w, t = 2 * np.pi / self.period, time - self.start
        c, s, fade = np.cos(w * t), np.sin(w * t), np.exp(-self.damping * t)
        angle, rate = self.cosine * c + self.sine * s, w * (self.sine * c - self.cosine * s)
        return float(fade * angle), float(fade * rate)


def _first_guess(recording: Recording) -> tuple[Recording, DecayingSine]:
    """The part of the recording in which the wheel swings well, and the sine that fits it best.

    Raises
    ------
    ResultError : there is none, too little of it, or it is too wide.
    """
    name, remedy = recording.name, "record at least ten free swings"
    if recording.time.size < FEWEST_SAMPLES:
        got = f"{recording.time.size} samples"
        raise ResultError(Finding(name, "the recording is too short for a swing", got, remedy))
    frequency = _strongest(recording)
    early = recording.time <= _faded(recording, 1 / frequency)
    recording = replace(recording, time=recording.time[early], values=recording.values[early])
    frequency = _strongest(recording)
    (zero, cosine, sine), rest = _sine_fit(frequency, recording.time - recording.time[0], recording.values)
    if rest > 0.5 * float(np.var(recording.values)):
        raise ResultError(Finding(name, "the recording has no free swing", "no clear period", remedy))
    swings = float(recording.time[-1] - recording.time[0]) * frequency
    if swings < FEWEST_SWINGS:
        got = f"{swings:.1f} swings of {1 / frequency:.3g} s"
        raise ResultError(Finding(name, "the recording is too short for a period", got, remedy))
    w = 2 * np.pi * frequency
    if recording.channel == "angular_rate":  # rate = w (sine cos - cosine sin)
        cosine, sine = -sine / w, cosine / w
    if np.hypot(cosine, sine) > LARGEST_SWING:
        got, remedy = (
            f"{np.degrees(np.hypot(cosine, sine)):.0f} deg",
            "check the unit of the channel, or release at a smaller angle",
        )
        raise ResultError(Finding(name, "the swing is too wide for a pendulum", got, remedy))
    _, sizes = _amplitudes(recording, 1 / frequency)
    damping = -np.polyfit(np.arange(sizes.size) / frequency, np.log(np.maximum(sizes, 1e-12)), 1)[0]
    return recording, DecayingSine(1 / frequency, float(damping), zero, float(recording.time[0]), cosine, sine)


def _strongest(recording: Recording) -> float:
    """The frequency, 1/s, of the strongest sine: from the spectrum, then by a comb around its peak."""
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
    """Constant, cosine and sine of one frequency (1/s), and the variance left."""
    phase = 2 * np.pi * frequency * t
    basis = np.column_stack([np.ones_like(t), np.cos(phase), np.sin(phase)])
    zero, cosine, sine = (float(x) for x in np.linalg.lstsq(basis, values, rcond=None)[0])
    left = values - basis @ np.array([zero, cosine, sine])
    return (zero, cosine, sine), float(np.mean(np.square(left)))


def _amplitudes(recording: Recording, period: float) -> tuple[Array, Array]:
    """Start (s) and standard deviation of each whole swing."""
    turn = ((recording.time - recording.time[0]) / period).astype(int)
    swings = range(max(int(turn[-1]), 1))
    sizes = np.array([np.std(recording.values[turn == k]) for k in swings])
    return recording.time[0] + period * np.array(swings), sizes


def _faded(recording: Recording, period: float) -> float:
    """When the swing has become so small that it shows friction rather than the period."""
    starts, sizes = _amplitudes(recording, period)
    small = np.flatnonzero(sizes[3:] < FADED * sizes[0])
    return float(starts[3 + small[0]] if small.size else recording.time[-1])


def _jump(whole: Regression, solution: Solution, time: Array) -> int | None:
    """The sample at which the swing jumped, if it clearly did.

    A disturbance at time tk adds a free swing exp(-D t) (c cos w t + s sin w t) from there on. Each tk's gain in the
    sum of squares, after refitting all else linearly, is compared with the residual that is left and with how many
    samples make one independent one (residuals of a real swing are correlated).
    """
    theta = np.concatenate([list(solution.values.values()), [v[0] for v in solution.per_run.values()]])
    rows = whole.rows(0, theta)
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
    """Sums over all later samples, along the first axis."""
    return np.asarray(np.cumsum(products[::-1], axis=0)[::-1])


def _samples_per_independent_one(residual: Array) -> float:
    """1 + 2 sum of the autocorrelation up to its first zero."""
    centered = residual - residual.mean()
    spectrum = np.abs(np.fft.rfft(centered, 2 * centered.size)) ** 2
    correlation = np.fft.irfft(spectrum)[: centered.size]
    first = int(np.argmax(correlation < 0)) or correlation.size
    return float(1 + 2 * np.sum(correlation[1:first]) / correlation[0])
