"""On which flank half-shafts with play rest when a drive begins."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import drive, parameters
from vdyn_cli.effects.backlash import SOFT, backlash
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.engine.simulate import Simulator
from vdyn_cli.physics.laws.torsion_shaft import rest_twist
from vdyn_cli.physics.models.vehicle import vehicle

PLAY = 0.015  # rad
TIME = np.arange(0.0, 1.0, 0.01)


def begun(torque: float) -> float:
    """Twist of a half-shaft of 20 kN m/rad with play, rad."""
    s = Signals(torque=torque, stiffness=2e4)
    return float(backlash.laws["rest_twist"](rest_twist, s, Signals(backlash=PLAY)))


@pytest.mark.parametrize("torque", [3.0, -3.0, 500.0])
def test_a_torque_presses_its_flank(torque: float) -> None:
    assert begun(torque) == pytest.approx(np.sign(torque) * PLAY + torque / 2e4, rel=1e-3)


def test_without_torque_it_rests_in_the_middle_and_little_is_needed_to_leave_it() -> None:
    assert begun(0.0) == 0.0
    assert begun(SOFT) == pytest.approx(PLAY / np.sqrt(2), rel=1e-3)


@pytest.mark.parametrize("torque", [1.5, -1.5])
def test_a_standing_car_begins_without_an_impact(torque: float) -> None:
    """From the middle of the gap a hundred newton meters would follow within a quarter of a second."""
    known = parameters()
    simulate = Simulator(vehicle(), known, ("backlash",), (backlash,), substeps=10)
    run = drive(TIME, drive_torque=np.full(TIME.size, torque), brake_torque=np.full(TIME.size, 1500.0))
    found = simulate(run, np.array([PLAY]), sensitivities=False).outputs["shaft_torque_left"]
    assert found == pytest.approx(0.5 * known["gear_ratio"] * torque, abs=1.5)
