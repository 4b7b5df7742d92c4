"""An uneven road that moves the axles is colored noise of the moment balance."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import logs
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.steps.cg.driven_channels import driven_channels, driven_responses
from vdyn_cli.steps.cg.load_windows import WINDOW, cut_windows
from vdyn_cli.steps.cg.uneven_road import uneven_road

SENSOR = 20.0  # N
SPEEDS = 0.05  # m/s, of the axles by the road
MASS = 100.0  # kg


def imbalances(speed: float) -> list[Array]:
    """Three runs of 20 s: white noise of the sensors, and an axle whose vertical speed is white."""
    random = np.random.default_rng(4)
    noise = SENSOR * random.standard_normal((3, 1000))
    return list(noise + MASS / WINDOW * speed * np.diff(random.standard_normal((3, 1001))))


def bands() -> list[Array]:
    return [np.array([np.full(1000, SENSOR**2), np.zeros(1000)])] * 3


def test_its_amplitude_is_found() -> None:
    found = uneven_road(imbalances(SPEEDS), bands(), WINDOW, 1500.0)
    variance = 2 * (MASS / WINDOW * SPEEDS) ** 2
    assert found[0] == pytest.approx(variance, rel=0.1)
    assert found[1] == pytest.approx(-variance / 2, rel=0.1)


def test_a_smooth_road_adds_no_noise() -> None:
    assert uneven_road(imbalances(0.0), bands(), WINDOW, 1500.0).size == 0


def test_a_run_that_begins_at_rest_is_predicted_by_runs_that_roll() -> None:
    """With a constant and "rolling" as collinear regressors, half of the load was missing at rest."""
    runs = [cut_windows(log) for log in logs(random_vehicle(4), 4)]
    runs[0].channels["rolling"][:100] = 0.0
    found = driven_channels(runs[0], runs[0].channels, 0.5, driven_responses(runs, 0.5)[0])
    for name in ("front_load", "rear_load"):
        assert abs(found[name][:100].mean() / runs[0].channels[name][:100].mean() - 1) < 0.1
