"""Wind on a test track: gusts within a run, and a mean that differs from run to run."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tests.plant.sensors import Array


@dataclass(frozen=True)
class Wind:
    """Gust: Ornstein-Uhlenbeck of standard deviation ``gust`` (m/s) and correlation time ``time`` (s);
    ``between_runs``: standard deviation of each run's own mean (m/s)."""

    gust: float = 0.6
    time: float = 8.0
    between_runs: float = 0.3


STILL = Wind(gust=0.0, between_runs=0.0)


def gusts(wind: Wind, runs: int, steps: int, step: float, rng: np.random.Generator) -> Array:
    """One stationary gust per run at ``steps`` equally spaced times, (steps, runs): the exact discrete process."""
    # w[k+1] = keep w[k] + fresh: a first-order recursive filter over white noise, begun in its stationary state.
    from scipy.signal import lfilter

    keep = np.exp(-step / wind.time)
    fresh = wind.gust * np.sqrt(1.0 - keep**2) * rng.standard_normal((steps, runs))
    fresh[0] = wind.gust * rng.standard_normal(runs)
    return np.asarray(lfilter([1.0], [1.0, -keep], fresh, axis=0))
