"""A receiver that filters its speed: the error of the speed lasts for seconds, and is neither gusts nor white."""

from __future__ import annotations

import numpy as np

from tests.coast_cases import known, log_of, spec_of
from tests.messy_cases import prepared
from tests.plant import coast, messy_day
from tests.plant.vehicle import random_vehicle
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.coastdown.step import STEP

DRIFT, TIME = 0.06, 2.0  # m/s rms, s


def received(log: Log, random: np.random.Generator) -> Log:
    """The log at 1 Hz, its speed with an error that forgets itself in ``TIME``."""
    time = np.arange(log.time[0], log.time[-1], 1.0)
    keep, error = float(np.exp(-1.0 / TIME)), np.empty(time.size)
    last = DRIFT * random.standard_normal()
    for k in range(time.size):
        error[k] = last
        last = keep * last + DRIFT * float(np.sqrt(1 - keep**2)) * random.standard_normal()
    return Log(log.name, time, {"speed": np.interp(time, log.time, log["speed"]) + error})


def test_a_filtered_error_of_the_speed_is_found_as_such() -> None:
    vehicle, random = random_vehicle(5), np.random.default_rng(17)
    runs = coast.campaign(vehicle, 5)
    logs = [received(log_of(run, f"run_{k}.csv"), random) for k, run in enumerate(runs, start=1)]
    found = STEP.estimate(spec_of(runs), logs, known(vehicle, coast.DAY))
    noise = found.extra["noise"]
    assert 0.6 * DRIFT < noise["speed_drift"] < 1.4 * DRIFT
    assert noise["gust"] < 0.9  # true: 0.6 m/s; without such an error in the model, 2.9
    for name in ("rolling_resistance", "drag_area"):
        low, high = found.parameters[name].interval95
        assert low <= getattr(vehicle, name) <= high


def test_a_small_remainder_of_the_road_is_no_error_of_the_speed() -> None:
    exact = messy_day.Logger(noise=0.001, step=0.0)
    day = messy_day.drive(21, messy_day.Day(rms=1e-3, waves="random", upper=25.0, lower=5.0, runs=6, logger=exact))
    campaign = prepared(day, False).problem.campaign_on_road  # type: ignore[attr-defined]
    assert not campaign.filtered
