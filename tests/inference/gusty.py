"""A coast-down in gusts as a regression: the synthetic case for tests of intervals.

Deceleration f + c V^2 with f 0.11 m/s^2 and c 2.8e-4 1/m; the speed has white noise, and a gust that forgets itself in
a few seconds pulls on the car by 2 c V w. The regression is whitened with a covariance that may be wrong.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.inference import Regression, Rows, Unknown, whiten
from vdyn_cli.inference.restricted_likelihood import NoisyRun, RandomUnknowns, _negative_likelihood

TRUTH = {"f": 0.11, "c": 2.8e-4}
STEP = 1.0  # s
FINE = 10  # steps of the truth within one


@dataclass(frozen=True)
class Case:
    """The drives, and the noise model that the engineer assumes."""

    runs: int
    duration: tuple[float, float] = (70.0, 70.0)  # s
    white: float = 0.05  # m/s
    gust: float = 0.6  # m/s
    memory: float = 8.0  # s
    run_wind: float = 0.0  # m/s, one draw for each run
    believed_gust: float = 0.6
    believed_memory: float = 8.0
    wind_prior: float = 0.0  # m/s; 0: no wind in the model


def speed(f: float, c: float, start: float, time: np.ndarray) -> np.ndarray:
    root = np.sqrt(f * c)
    return np.sqrt(f / c) * np.tan(np.arctan(start * np.sqrt(c / f)) - root * time)


def record(case: Case, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Time and measured speed of one run."""
    f, c = TRUTH["f"], TRUTH["c"]
    time = np.arange(0, rng.uniform(*case.duration), STEP)
    start, dt = 25 + rng.standard_normal(), STEP / FINE
    still = speed(f, c, start, np.arange(0, time[-1] + dt, dt))
    keep = np.exp(-dt / case.memory)
    shocks = rng.standard_normal(still.size) * case.gust * np.sqrt(1 - keep**2)
    steady = case.run_wind * rng.standard_normal()
    wind, lost, seen = case.gust * rng.standard_normal(), 0.0, np.empty(still.size)
    for i, v in enumerate(still):
        seen[i] = v + lost
        lost += -2 * c * v * (lost + wind + steady) * dt
        wind = keep * wind + shocks[i]
    return time, seen[::FINE][: time.size] + case.white * rng.standard_normal(time.size)


def believed_factor(case: Case, time: np.ndarray, v: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Cholesky factor of the assumed noise, and the response of the speed to 1 m/s of steady wind."""
    c = TRUTH["c"]
    fade = np.exp(-np.cumsum(2 * c * v) * STEP)
    pull = np.tril(np.outer(fade, 1 / fade), -1) * (-2 * c * v * STEP)
    gust = case.believed_gust**2 * np.exp(-np.abs(time[:, None] - time) / case.believed_memory)
    noise = pull @ gust @ pull.T + case.white**2 * np.eye(time.size)
    return np.linalg.cholesky(noise), pull.sum(axis=1)


def campaign(case: Case, seed: int) -> Regression:
    rng = np.random.default_rng(seed)
    records = [record(case, rng) for _ in range(case.runs)]
    factors = [believed_factor(case, t, speed(**TRUTH, start=y[0], time=t)) for t, y in records]

    def rows(run: int, theta: np.ndarray) -> Rows:
        (time, measured), (factor, wind) = records[run], factors[run]
        steps = 1e-30j * np.eye(3)
        jacobian = np.column_stack([speed(*(theta[:3] + s), time).imag / 1e-30 for s in steps])
        residual = speed(*theta[:3], time) - measured
        if case.wind_prior:
            residual, jacobian = residual + wind * theta[3], np.column_stack([jacobian, wind])
        return Rows(*whiten(residual, jacobian, cholesky=factor))

    unknowns = [
        Unknown("f", 0.1, 0.0, 1.0, "m/s^2"),
        Unknown("c", 3e-4, 1e-6, 1e-2, "1/m"),
        Unknown("start", 25.0, 5.0, 60.0, "m/s", per_run=True, nuisance=True),
    ]
    if case.wind_prior:
        unknowns.append(Unknown("wind", 0.0, -10, 10, "m/s", (0.0, case.wind_prior), per_run=True, nuisance=True))
    return Regression(tuple(unknowns), tuple(f"run {i + 1}" for i in range(case.runs)), rows)


def restricted_likelihood(
    runs: Sequence[NoisyRun], sizes: Mapping[str, float], known: np.ndarray, random: RandomUnknowns | None = None
) -> tuple[float, dict[str, float]]:
    """The negative restricted log likelihood, and its derivatives to the logarithms of the amplitudes, by name."""
    found = _negative_likelihood(runs, sizes, known, random)
    return found.value, dict(zip(sizes, found.gradient.tolist(), strict=True))
