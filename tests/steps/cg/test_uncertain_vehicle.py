"""The uncertainty of the vehicle's known numbers is in the intervals as large as it moves the results."""

from __future__ import annotations

import pytest

from tests.plant.vehicle import random_vehicle
from tests.steps.cg.test_cg import SPEC, known, logs
from vdyn_cli.steps.cg.problem import prepare


def test_standard_deviations_contain_the_change_by_an_uncertain_mass() -> None:
    vehicle, std = random_vehicle(2), 8.0
    runs = logs(vehicle, 2)[:1]
    uncertain = prepare(SPEC, runs, known(vehicle, mass=std))
    shifted = prepare(SPEC, runs, known(vehicle.but(mass=vehicle.mass + std))).baseline
    result, fitted = uncertain.publish(), uncertain.baseline
    for name in ("cg_height", "pitch_inertia"):
        inherited = (result.parameters[name].std ** 2 - fitted.std[name] ** 2) ** 0.5
        assert inherited == pytest.approx(abs(shifted.values[name] - fitted.values[name]), rel=0.05), name
