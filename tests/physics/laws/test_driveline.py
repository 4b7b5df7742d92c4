"""The power that a driveline takes away, whichever end drives it."""

from __future__ import annotations

import pytest

from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.physics.laws.driveline import drive

RATIO, RADIUS, EFFICIENCY, SPEED = 9.0, 0.3, 0.95, 14.0  # -, m, -, m/s


@pytest.mark.parametrize("torque", [-80.0, -1.0, 0.0, 5.0, 120.0])
def test_a_driveline_loses_the_same_share_of_the_power_that_enters_at_either_end(torque: float) -> None:
    signals = Signals(
        drive_torque=torque,
        gear_ratio=RATIO,
        wheel_radius=RADIUS,
        driveline_efficiency=EFFICIENCY,
        recuperation_loss=1.0,
    )
    wheels, motor = float(drive(signals)) * SPEED, torque * RATIO * SPEED / RADIUS
    if torque < 0:
        assert motor == pytest.approx(EFFICIENCY * wheels)  # W, of recuperation
    else:
        assert wheels == pytest.approx(EFFICIENCY * motor)


def test_a_torque_that_holds_the_efficiency_is_scaled_alike_under_recuperation() -> None:
    signals = Signals(
        drive_torque=-80.0,
        gear_ratio=RATIO,
        wheel_radius=RADIUS,
        driveline_efficiency=EFFICIENCY,
        recuperation_loss=-1.0,
    )
    assert float(drive(signals)) == pytest.approx(-80.0 * EFFICIENCY * RATIO / RADIUS, rel=0.003)
