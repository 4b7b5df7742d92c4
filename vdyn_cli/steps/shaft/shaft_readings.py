"""The readings of a half-shaft's log: torque, twist and its rate, their noise, and checks of the channels."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from vdyn_cli.engine.simulate import Drive
from vdyn_cli.inference import exceeds_noise, white_level
from vdyn_cli.io.clocks.block_means import condensed
from vdyn_cli.physics.laws.twist_friction import turned_twist
from vdyn_cli.quantities.arrays import Array, Rows, cumulative_integral
from vdyn_cli.quantities.errors import Finding, raise_all
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.shaft.encoder_angles import (
    ANGLES,
    at_shifted_times,
    ratio_of_angles_doubts,
    twist_resolution,
    unwrapped,
    with_twist_of_angles,
)
from vdyn_cli.steps.shaft.motor_acceleration import acceleration
from vdyn_cli.steps.shaft.policy import SHAFT_POLICY
from vdyn_cli.steps.shaft.spec import SIDES, ShaftSpec, SideName
from vdyn_cli.steps.sign_conventions import REMEDY, cosine, wrong_sign

UNREAD_TWIST = 0.3  # rad, standard deviation of a twist that was not logged: ten times the twist of a hard tip-in
UNREAD_RATE = 30.0  # rad/s, likewise of its rate
# Hz, to which a twist without logged speeds is averaged: the noise of its rate falls with the time step to the power
# 1.5. At 1 kHz that noise is as large as the rate in a tip-in, and the damping would depend on its estimate.
TWIST_RATE = 500.0
# Samples per period of the fastest oscillation of the twist: the integral over six rates errs by 0.1 % there.
OSCILLATION = 8.0
SEEN = 2.0  # spectral density over that of the white noise; a mean over 20 segments of noise alone scatters by 22 %
ROUNDING = 1e-9  # relative, by which a block is shorter: a sample at its end, rounded, is in the next one
NODES = 6  # samples of a logged rate through which a polynomial is laid, for its integral over a step
REACH = 8  # samples on either side to which an interpolated value is sensitive
MOST_ADJUSTED = 3.0  # standard deviations of a reading, by which it is adjusted at most: noise exceeds it once in 370
FEWEST_SAMPLES = 200  # a second at 200 Hz: two or three oscillations of a driveline
MOST_TWIST = 3.0  # rad: no half-shaft twists so far while a brake holds the wheel
DEAD = 0.02  # share of the other speed below which a speed sensor counts as failed
NOT_LOGGED = np.zeros(0)
TURNING = 1.0  # rad/s of the wheel, above which the ratio of the speeds is accurate enough


@dataclass(frozen=True)
class ShaftReadings:
    """One run's readings, without gaps in the values.

    Parameters
    ----------
    name : of the log. time, torque, twist, rate : (n,), SI; of twist and rate, one that is not logged is computed from
        the other.
    noise : standard deviations of torque (N m), twist (rad), rate (rad/s).
    motor_speed : (n,), rad/s, of the inner end; empty where it is not logged. motor_noise : its standard deviation.
    """

    name: str
    time: Array
    torque: Array
    twist: Array
    rate: Array
    noise: tuple[float, float, float]
    motor_speed: Array = field(default_factory=lambda: NOT_LOGGED)
    motor_noise: float = 0.0

    @classmethod
    def of(cls, log: Log, gear_ratio: float, resolution: float = 0.0) -> ShaftReadings:
        """The readings of a log, with the rate of twist by motor_speed / gear_ratio - wheel_speed, else by the twist.

        Parameters
        ----------
        log : shaft_torque (N m), and twist (rad), or motor_speed and wheel_speed (rad/s), or all of them. Rows in
            which one is missing are left out. gear_ratio : turns of the motor_speed channel per turn of the wheel.
        resolution : rad, least standard deviation of the twist.
        """
        used = _used(log)
        good = np.all([np.isfinite(log[name]) for name in used], axis=0)
        time, values = log.time[good], {name: log[name][good] for name in used}
        if "motor_speed" in used:
            rate = values["motor_speed"] / gear_ratio - values["wheel_speed"]
            rate_noise = white_level(rate, time)
            motor = values["motor_speed"] / gear_ratio
        else:
            rate, rate_noise = np.gradient(values["twist"], time), UNREAD_RATE
            motor = NOT_LOGGED
        if "twist" in used:
            twist, twist_noise = values["twist"], max(white_level(values["twist"], time), resolution)
        else:
            twist_noise = UNREAD_TWIST
            twist = cumulative_integral(time, rate)
        noise = white_level(values["shaft_torque"], time), twist_noise, rate_noise
        motor_noise = white_level(motor, time) if motor.size else 0.0
        return cls(log.name, time, values["shaft_torque"], twist, rate, noise, motor, motor_noise)

    def averaged(self) -> ShaftReadings:
        """Means over blocks, ``OSCILLATION`` or more per period of the fastest oscillation of the rate above its noise.

        The noise at higher frequencies contains nothing on the damping c, but its weight in the fit depends on c: 0.07
        rad/s of noise at 500 Hz scattered c by 9 N m s/rad, instead of 3 at 80 Hz. Noise levels are those before
        averaging: in the differences of the means the oscillations count.
        """
        from scipy.signal import welch

        frequency = 1.0 / float(np.median(np.diff(self.time)))
        f, density = welch(self.rate, frequency, nperseg=min(round(frequency), self.time.size))
        fastest = max(f[density > SEEN * 2 * self.noise[2] ** 2 / frequency], default=np.inf)
        samples = frequency // (OSCILLATION * fastest)
        if samples < 2:
            return self
        speed = {"motor": self.motor_speed} if self.motor_speed.size else {}
        whole = Log(self.name, self.time, {"torque": self.torque, "rate": self.rate, **speed})
        log = condensed(whole, frequency / samples * (1.0 + ROUNDING))
        torque, twist, rate = self.noise
        noise = torque / samples**0.5, twist, rate / samples**0.5
        twists = cumulative_integral(log.time, log["rate"])
        motor = (log["motor"], self.motor_noise / samples**0.5) if speed else (NOT_LOGGED, 0.0)
        return ShaftReadings(self.name, log.time, log["torque"], twists, log["rate"], noise, *motor)

    @property
    def conditions_per_sample(self) -> int:
        """Number of conditions on each sample that logged channels can violate, 0 to 2."""
        return 2 - (self.noise[1] == UNREAD_TWIST) - self.rate_unread

    @property
    def rate_unread(self) -> bool:
        """Whether the rate was not logged, but computed from the twist."""
        return self.noise[2] == UNREAD_RATE

    def twist_error(self, stiffness: float) -> float:
        """Upper bound of the standard deviation of an adjusted twist, rad: (1 / twist^2 + k^2 / torque^2)^-0.5.

        ``stiffness`` k in N m/rad. The integration conditions, which reduce it further, are left out.
        """
        torque, twist, _ = self.noise
        return float((twist**-2 + (stiffness / torque) ** 2) ** -0.5) if twist and torque else 0.0

    @property
    def nodes(self) -> tuple[Rows, ...]:
        """Indices (n - 1,) of the samples on which each integration condition has weights, by column of ``chain``.

        Those beyond the ends of the run have no weight.
        """
        step = np.arange(self.time.size - 1)
        reach = range(-1, 2) if self.rate_unread else range(1 - NODES // 2, 1 + NODES // 2)
        return tuple(np.clip(step + ahead, 0, self.time.size - 1) for ahead in reach)

    @cached_property
    def chain(self) -> tuple[Array, Array]:
        """Weights of the twists and of the rates at ``nodes`` in each integration condition, (n - 1, nodes).

        phi(i+1) - phi(i) is the integral of the polynomial through the six rates around the step: by the trapezoidal
        rule, a twist that oscillates at w would be too small by (w h)^2 / 12 in steps h, 13 % at 20 Hz logged at
        100 Hz. Steps near the ends have the trapezoidal rule.

        Rates that were not logged could alternate in sign under this condition and absorb the torque's noise through
        the damping. So they are tied to the twists on both sides by Simpson's rule,
        phi(i+1) - phi(i-1) = h (phi'(i-1) + 4 phi'(i) + phi'(i+1)) / 3, here for unequal steps.
        """
        step = np.diff(self.time)
        here = 1 if self.rate_unread else NODES // 2 - 1  # column of sample i
        twist, rate = np.zeros((2, step.size, len(self.nodes)))
        twist[:, here : here + 2] = -1.0, 1.0
        rate[:, here : here + 2] = -step[:, None] / 2
        if self.rate_unread:
            a, b = step[:-1], step[1:]
            twist[1:] = -1.0, 0.0, 1.0
            rate[1:] = -(a + b)[:, None] / 6 * np.column_stack([2 - b / a, (a + b) ** 2 / (a * b), 2 - a / b])
        else:
            rate[here:-here] = -_integral_weights(self.time)
        return twist, rate

    def linked(self, twist: Array, rate: Array) -> Array:
        """Residuals (n - 1,) rad of the integration conditions (``chain``) for twists (n,) rad, rates (n,) rad/s."""
        to_twist, to_rate = self.chain
        at = np.column_stack(self.nodes)
        return np.asarray(np.sum(to_twist * twist[at] + to_rate * rate[at], axis=1))

    def within_noise(self, twist: Array, rate: Array, motor: Array) -> tuple[Array, Array, Array]:
        """Adjusted twists, rates and motor speeds, (n,) each; the readings where they move beyond noise.

        A law that the logs contradict would else move the twist towards itself, and bend the curve of its own error.
        """
        of_motor = self.motor_speed, motor, self.motor_noise
        read = (self.twist, twist, self.noise[1]), (self.rate, rate, self.noise[2]), of_motor
        near = [np.where(np.abs(found - x) > MOST_ADJUSTED * std, x, found) for x, found, std in read]
        return near[0], near[1], near[2]

    @cached_property
    def turned(self) -> Array:
        """Sense of dry friction (``turned_twist``), (n,); 0 where the noise of the twist hides its reversals."""
        return turned_twist(self.twist, self.noise[1])

    def drive(self, twist: Array, rate: Array, motor: Array) -> Drive:
        """The shaft's inputs at the run's times: twist (rad), its rate and the motor's speed (rad/s), (n,) each."""
        accelerated = acceleration(self.time, motor)
        moved = {"twist": twist, "twist_rate": rate, "turned_twist": self.turned, "motor_acceleration": accelerated}
        return Drive(self.time, {**moved, "run_time": self.time - self.time[0]})


def _integral_weights(time: Array) -> Array:
    """Weights of six samples in the integral over the step in their middle, (n - NODES + 1, NODES), s."""
    around = np.lib.stride_tricks.sliding_window_view(time, NODES)
    left, right = around[:, NODES // 2 - 1], around[:, NODES // 2]
    step, powers = right - left, np.arange(NODES)
    ends = 0.5 ** (powers + 1) * (1 - (-1.0) ** (powers + 1)) / (powers + 1)  # integrals of x^p from -1/2 to 1/2
    samples = ((around - ((left + right) / 2)[:, None]) / step[:, None])[:, None, :] ** powers[:, None]
    weights = np.linalg.solve(samples, np.broadcast_to(ends[:, None], (len(step), NODES, 1)))[:, :, 0]
    return np.asarray(step[:, None] * weights)


def _with_torque_on_time(log: Log, delay: float) -> Log:
    """The log with its torque shifted ``delay`` s earlier, to compensate for its delay.

    A torque that was interpolated between its own samples is left at these; the other channels are interpolated there.
    """
    if "shaft_torque" in log.samples:
        time, torque = log.samples["shaft_torque"]
        others = {n: unwrapped(x) if n in ANGLES else x for n, x in log.channels.items()}
        there = {n: np.interp(time - delay, log.time, x, left=np.nan, right=np.nan) for n, x in others.items()}
        return Log(log.name, time - delay, {**there, "shaft_torque": torque})
    if not delay or not np.isfinite(log["shaft_torque"]).any():
        return log
    return log.with_channels(shaft_torque=at_shifted_times(log.time, log["shaft_torque"], delay))


def _with_noise_of_samples(run: ShaftReadings, sampled: Log, steps: float) -> ShaftReadings:
    """The readings with the torque's noise by its own samples, where it is interpolated between them.

    Neighbors share samples, so that their differences show too little noise. With weights w of the samples, which sum
    to 1, noise sigma of these becomes sigma |w|, and means over H, of samples at intervals h, have
    sigma sqrt(h/H (1 - (1 - |w|^2) h/H)).

    Parameters
    ----------
    sampled : the torque as logged. steps : by which it is shifted, in intervals of its samples.
    """
    at = np.arange(2.0 * REACH)
    weights = [at_shifted_times(at, one, steps % 1.0)[REACH - 1] for one in np.eye(at.size)]
    means = _interval(sampled.time) / _interval(run.time)
    noise = white_level(sampled["shaft_torque"], sampled.time)
    noise *= float(np.sqrt(means * (1.0 - (1.0 - np.dot(weights, weights)) * means)))
    return replace(run, noise=(noise, *run.noise[1:]))


def _interval(time: Array) -> float:
    return float(np.median(np.diff(time)))


def _used(log: Log) -> list[str]:
    """The channels of the log that are used; a single speed is not."""
    speeds = [n for n in ("motor_speed", "wheel_speed") if n in log]
    return ["shaft_torque", *(["twist"] if "twist" in log else []), *(speeds if len(speeds) == 2 else [])]


def readings_of(spec: ShaftSpec, logs: Sequence[Log], delay: float) -> dict[SideName, tuple[ShaftReadings, ...]]:
    """The readings of the runs of each side, with the torque shifted earlier by its ``delay``, s.

    Raises
    ------
    InputError : no twist and no speeds, a wrong sign or gear ratio, a log that is too short or contains only noise.
    """
    ratio = spec.settings.gear_ratio.value
    found: dict[SideName, list[ShaftReadings]] = {name: [] for name in SIDES}
    findings: list[Finding] = []
    for run, logged in zip(spec.runs, logs, strict=True):
        by_angles = "twist" not in logged and all(name in logged for name in ANGLES)
        if by_angles and (doubts := ratio_of_angles_doubts(logged, ratio)):
            findings += doubts
            continue
        log = _with_torque_on_time(logged, delay)
        log = with_twist_of_angles(log, ratio) if by_angles else log
        used = _used(log)
        if "motor_speed" not in used:
            log = condensed(log, TWIST_RATE)
        if len(used) == 1:
            remedy = "map 'twist', or 'motor_speed' and 'wheel_speed', or 'motor_angle' and 'wheel_angle'"
            findings.append(Finding("channels", "the twist of the shaft cannot be computed", "", remedy))
            break
        samples = np.count_nonzero(np.all([np.isfinite(log[name]) for name in used], axis=0))
        if samples < FEWEST_SAMPLES:
            what = f"has {samples} samples with readings in every channel: {FEWEST_SAMPLES} are needed"
            findings.append(Finding(log.name, what, "", "log longer or at a higher rate, or leave the run out"))
            continue
        readings = ShaftReadings.of(log, ratio, twist_resolution(logged, ratio) if by_angles else 0.0)
        if "twist" not in used:
            readings = readings.averaged()
        if delay and "shaft_torque" not in logged.samples:
            sampled = condensed(logged, TWIST_RATE) if "motor_speed" not in used else logged
            readings = _with_noise_of_samples(readings, sampled, delay / _interval(logged.time))
        doubts = [*speed_ratio_doubts(log, ratio), *_too_gentle(readings), *_wrong_sign(readings, "twist" in log)]
        findings += doubts[:1]
        found[run.side].append(readings)
    raise_all(dict.fromkeys(findings))
    return {side: tuple(runs) for side, runs in found.items()}


def speed_ratio_doubts(log: Log, ratio: float) -> list[Finding]:
    """Findings on a speed sensor that failed, or on speeds whose median ratio is not the gear ratio.

    Failed: below ``DEAD`` of the other speed while that turns by more than ``MOST_TWIST``. The ratio may deviate by
    ``ratio_agreement``, relative.

    Parameters
    ----------
    ratio : turns of motor_speed per turn of the wheel.
    """
    if not ("motor_speed" in log and "wheel_speed" in log):
        return []
    motor, wheel = log["motor_speed"], log["wheel_speed"]
    for dead, alive, still, turns in (
        ("motor_speed", "wheel_speed", motor / ratio, wheel),
        ("wheel_speed", "motor_speed", wheel, motor / ratio),
    ):
        if np.nanmax(np.abs(still)) < DEAD * np.nanmax(np.abs(turns)) and _turned(log.time, turns) > MOST_TWIST:
            what = f"stays below {100 * DEAD:.0f} % of {alive}: sensor failed or not connected"
            return [Finding(f"{log.name}, channel '{dead}'", what, "", "map 'twist' instead, or leave the run out")]
    turning = np.isfinite(motor) & np.isfinite(wheel) & (np.abs(wheel) > TURNING)
    if not turning.any():
        return []
    seen = float(np.median(motor[turning] / wheel[turning]))
    if abs(seen / ratio - 1) < SHAFT_POLICY.ratio_agreement:
        return []
    remedy = f"write 'gear_ratio: {seen:.4g}' under settings" if seen > 0 else "add 'sign: -1' to one of the speeds"
    what = f"motor_speed and wheel_speed have the ratio {seen:.4g}, not the gear ratio {ratio:g}"
    return [Finding(log.name, what, "", remedy)]


def _turned(time: Array, speed: Array) -> float:
    """Range of the angle turned, rad."""
    there = np.isfinite(speed)
    return float(np.ptp(np.cumsum(np.diff(time[there]) * speed[there][1:])))


def _too_gentle(run: ShaftReadings) -> list[Finding]:
    if np.ptp(run.twist) == 0.0:
        return [Finding(run.name, "the twist is constant", f"{run.twist[0]:.3g} rad", "check its sensor and its unit")]
    move, noise = float(np.std(run.torque)) if np.ptp(run.torque) else 0.0, run.noise[0]
    if exceeds_noise(move, noise, run.torque.size):
        return []
    got = f"standard deviation {move:.3g} N m, noise {noise:.3g} N m"
    what = "the shaft torque is constant within its noise"
    return [Finding(run.name, what, got, "tip in and out with more torque, in a low gear")]


def _wrong_sign(run: ShaftReadings, twist_read: bool) -> list[Finding]:
    if np.ptp(run.twist) == 0 or cosine(run.torque - run.torque.mean(), run.twist - run.twist.mean()) > 0:
        return []
    channel, what = "twist" if twist_read else "motor_speed and wheel_speed", "the twist falls where the torque rises"
    return [wrong_sign(run.name, channel, what, "", f"{REMEDY}, or to shaft_torque")]
