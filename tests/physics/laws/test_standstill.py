"""Dry contacts: what turns them, how they hold, how they slip."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.physics.laws.brake import brake
from vdyn_cli.physics.laws.driveline import driveline
from vdyn_cli.physics.laws.rolling_resistance import rolling
from vdyn_cli.physics.laws.standstill_friction import BEND, QUICKEST, bristle_rate, bristle_sense, turned


def rate(speed: float, bend: float) -> float:
    return float(bristle_rate(Signals(speed=speed, bend=bend)))


def test_friction_turns_with_the_motion() -> None:
    assert float(turned(0.0)) == 0.0
    assert float(turned(-1.0)) == pytest.approx(-1.0, abs=1e-12)
    assert float(turned(0.05)) == pytest.approx(np.tanh(1.0))


@pytest.mark.parametrize("speed", [1e-3, 0.1, 3.0, 60.0])
def test_a_bristle_bends_until_it_slips(speed: float) -> None:
    assert rate(speed, 0.0) > 0
    assert rate(speed, 1.0) == pytest.approx(0.0, abs=0.1 * rate(speed, 0.0))
    assert rate(speed, -1.0) == pytest.approx(2 * rate(speed, 0.0), rel=0.1)  # turned round, it comes back
    assert rate(-speed, 0.5) == -rate(speed, -0.5)


def test_at_rest_a_bristle_is_a_spring_that_does_not_creep() -> None:
    assert rate(0.0, 0.7) == 0.0
    assert rate(1e-7, 0.0) == pytest.approx(1e-7 / BEND, rel=1e-3)
    assert rate(1e-7, 0.9) == pytest.approx(rate(1e-7, 0.0), rel=1e-3)  # held, it lets nothing go


def test_no_bristle_turns_faster_than_a_step_can_follow() -> None:
    speed = 80.0
    slope = (rate(speed, 0.5) - rate(speed, 0.4)) / 0.1
    assert slope == pytest.approx(-1 / QUICKEST, rel=1e-2)


def test_a_bristle_s_damping_goes_when_it_slides() -> None:
    held = Signals(bend=0.2, bend_rate=3.0, damping_time=0.1, speed=0.0)
    assert float(bristle_sense(held)) == pytest.approx(0.5)
    assert float(bristle_sense(held.but(speed=10.0))) == pytest.approx(0.2, abs=1e-4)


def test_dry_forces_scale_with_their_sense() -> None:
    s = Signals(sense=-0.5, speed=-2.0, share=1.0)
    tires = s.but(rolling_resistance=0.01, rolling_speed=1e-4, load=4000.0)
    assert rolling(tires) == pytest.approx(-0.5 * 4000 * (0.01 - 2e-4))
    assert brake(s.but(brake_force=300.0)) == -150.0
    assert driveline(s.but(driveline_drag=20.0, driveline_viscous=1.0)) == -9.0
