"""A step that the vehicle cannot take: refused in words, whether it explodes or only lies."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import drive, parameters, pedals
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.errors import ResultError


def launch(step: float) -> Drive:
    time = np.arange(0.0, 6.0, step)
    return drive(time, **pedals(time, (0, 0, 0), (1, 300, 0), (3, 300, 0), (3.1, 0, 4000), (6, 0, 4000)))


def test_a_step_that_explodes_names_time_state_and_remedy():
    with pytest.raises(ResultError, match=r"'vehicle' at t = [\d.]+ s: \w+.*step of 20 ms is too large") as caught:
        Simulator(vehicle(), parameters())(launch(0.02))
    assert "check the parameters" in str(caught.value)


def test_a_step_that_stays_finite_and_lies_is_found():
    simulate = Simulator(vehicle(), parameters())
    assert np.all(np.isfinite(simulate(launch(0.004)).outputs["speed"]))
    assert max(simulate.step_error(launch(0.004)).values()) > 0.05
    fine = Simulator(vehicle(), parameters(), substeps=10)
    assert max(fine.step_error(launch(0.01)).values()) < 2e-3
