"""How well two loggers' clocks are aligned: ``python -m tests.bench.align_accuracy [cases]``.

For each kind of drive and sensors: bias and root-mean-square error of the delay, its Cramer-Rao bound (white noise on
both recordings, gain and offset unknown), and how often the true delay lies within the 95 % interval.
"""

from __future__ import annotations

import sys
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.clocks.clock_estimate import clock_difference
from vdyn_cli.io.clocks.tied_channels import ChannelTie
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log

Array = NDArray[np.float64]

FINE = 0.001  # s, step of the true motion
QUANTILE = 2.160  # Student's t, 13 degrees of freedom, two-sided 95 %


@dataclass(frozen=True)
class Kind:
    """A drive, two loggers' rates and noise, and what differs between their sensors."""

    motion: str = "drive"
    rates: tuple[float, float] = (100.0, 10.0)
    noise: tuple[float, float] = (0.05, 0.03)
    delay: float = 0.1234
    gain: float = 1.0
    offset: float = 0.0
    jitter: float = 0.0  # of the other's sampling, in steps
    colour: float = 0.0  # s, correlation time of further noise
    duration: float = 120.0


KINDS = {
    "test drive, 100 and 10 Hz": Kind(),
    "10 and 100 Hz, far apart": Kind(rates=(10.0, 100.0), noise=(0.03, 0.05), delay=-7.3),
    "noisy, gain and offset": Kind(noise=(0.5, 0.3), gain=0.99, offset=0.1),
    "jitter, 100 and 85 Hz": Kind(rates=(100.0, 85.0), noise=(0.05, 0.05), gain=0.992, jitter=0.4),
    "coloured noise": Kind(rates=(100.0, 20.0), noise=(0.05, 0.05), colour=0.5),
    "one acceleration and stop": Kind(motion="stop"),
    "coast-down": Kind(motion="coast"),
    "hardly any noise": Kind(noise=(1e-4, 1e-4)),
}


def motion(kind: Kind, rng: np.random.Generator) -> tuple[Array, Array]:
    """Time and speed of the car."""
    t = np.arange(-5.0, kind.duration + 5.0, FINE)
    if kind.motion == "drive":
        knots = np.sort(rng.uniform(t[0], t[-1], int(kind.duration / 4.0) + 4))
        pull = np.interp(t, knots, rng.normal(0.0, 1.0, knots.size))
        return t, 15.0 + np.cumsum(_smoothed(pull, 0.8)) * FINE
    if kind.motion == "stop":
        pull = 2.5 * ((t > 20.0) & (t < 28.0)) - 3.3 * ((t > 60.0) & (t < 66.0))
        return t, np.cumsum(_smoothed(pull, 0.4)) * FINE
    slow = np.sqrt(0.1 / 0.0004)  # coasting against 0.1 + 0.0004 v^2
    return t, slow * np.tan(np.maximum(np.arctan(35.0 / slow) - np.sqrt(0.1 * 0.0004) * (t + 5.0), 0.0))


def _smoothed(values: Array, width: float) -> Array:
    kernel = np.hanning(int(width / FINE) + 1)
    return np.convolve(values, kernel / kernel.sum(), "same")


def recordings(kind: Kind, rng: np.random.Generator) -> tuple[Log, Log, float]:
    """The two logs and the Cramer-Rao bound of the delay, s."""
    t, speed = motion(kind, rng)
    ours = np.arange(0.0, kind.duration, 1.0 / kind.rates[0])
    theirs = np.arange(rng.uniform(0.0, 1.0 / kind.rates[1]), kind.duration, 1.0 / kind.rates[1])
    theirs = np.sort(theirs + rng.uniform(-kind.jitter, kind.jitter, theirs.size) / kind.rates[1])
    x = np.interp(ours, t, speed) + _noise(ours.size, kind.noise[0], kind.rates[0], kind.colour, rng)
    y = kind.gain * np.interp(theirs, t, speed) + kind.offset
    y += _noise(theirs.size, kind.noise[1], kind.rates[1], kind.colour, rng)
    logs = Log("ours", ours, {"speed": x}), Log("theirs", theirs + kind.delay, {"speed": y})
    inside = (t >= 0.0) & (t <= kind.duration)
    slope = np.gradient(speed, FINE)[inside]
    basis, _ = np.linalg.qr(np.column_stack([np.ones(slope.size), speed[inside]]))
    own = slope - basis @ (basis.T @ slope)
    density = kind.noise[0] ** 2 / kind.rates[0] + (kind.noise[1] / kind.gain) ** 2 / kind.rates[1]
    return *logs, float(np.sqrt(density / (np.sum(own * own) * FINE)))


def _noise(n: int, std: float, rate: float, colour: float, rng: np.random.Generator) -> Array:
    white = rng.normal(0.0, std, n)
    if colour == 0.0:
        return white
    keep, slow = float(np.exp(-1.0 / (rate * colour))), np.zeros(n)
    for i, step in enumerate(rng.normal(0.0, std * np.sqrt(1.0 - keep**2), n - 1)):
        slow[i + 1] = keep * slow[i] + step
    return white + slow


def main(arguments: list[str]) -> int:
    cases = int(arguments[0]) if arguments else 200
    print("| recordings | bias, ms | rms, ms | rms / bound | covered | refused |\n|---|---|---|---|---|---|")
    for name, kind in KINDS.items():
        errors, ratios, covered, refused = [], [], 0, 0
        for seed in range(cases):
            ours, theirs, bound = recordings(kind, np.random.default_rng([seed, 41]))
            try:
                found = clock_difference(ours, theirs, ChannelTie("speed", "speed"))
                delay, std = found.delay, found.delay_std
            except InputError:
                refused += 1
                continue
            errors.append(delay - kind.delay)
            ratios.append(errors[-1] / bound)
            covered += abs(errors[-1]) < QUANTILE * std
        bias, rms, ratio = 1e3 * np.mean(errors), 1e3 * np.std(errors), np.sqrt(np.mean(np.square(ratios)))
        share = covered / len(errors)
        print(f"| {name} | {bias:+.3f} | {rms:.3f} | {ratio:.2f} | {share:.1%} | {refused} |", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
