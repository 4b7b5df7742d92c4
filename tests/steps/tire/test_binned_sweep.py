"""The noise of a slip is counted in full, also where its speed has a slower clock than the forces."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.tire.binned_sweep import binned_sweep

NOISE, SPEED = 0.05, 20.0  # m/s


@pytest.mark.parametrize("every", [1, 5, 10])
def test_the_variance_of_a_bin_is_that_of_its_mean(every: int) -> None:
    random, time = np.random.default_rng(7), np.arange(40_000) / 100.0
    own = time[::every]
    read = SPEED + NOISE * random.standard_normal(own.size)
    speed = np.interp(time, own, read)
    force = 1000.0 + random.standard_normal(time.size)
    channels = {"slip": SPEED / speed - 1, "force_x": force, "force_z": 4.0 * force, "vehicle_speed": speed}
    log = Log("sweep.csv", time, channels, samples={"vehicle_speed": (own, read)} if every > 1 else {})
    sweep = binned_sweep(log)
    expected = float(np.sqrt(np.mean(sweep.slip_variance)))
    assert float(np.std(sweep.slip)) == pytest.approx(expected, rel=0.15)
