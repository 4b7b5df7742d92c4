"""Tip-in and back-out: what rings in the simulation is the driveline's eigenmode."""

from __future__ import annotations

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import parameters
from vdyn_cli.physics.models.tip_in import ringing, tip_in
from vdyn_cli.physics.models.vibration_modes import modes


@pytest.mark.parametrize(("speed", "close"), [(5.0, 0.01), (15.0, 0.01)])
def test_small_steps_ring_as_the_eigenmodes_say(speed, close):
    car = parameters()
    found, table = tip_in(car, speed, 5.0), {mode.name: mode for mode in modes(car, speed)}
    for phase in (found.tip_in, found.back_out):
        for side, swing in phase.swing.items():
            mode = table["driveline shuffle"]
            assert swing.frequency == pytest.approx(mode.frequency * np.sqrt(1.0 - mode.damping**2), rel=close), side
            assert swing.damping == pytest.approx(mode.damping, abs=0.015), side


def test_a_back_out_mirrors_a_tip_in():
    car = parameters()
    one, two = (tip_in(car, 10.0, size) for size in (5.0, 10.0))
    assert two.tip_in.jerk_peak == pytest.approx(2 * one.tip_in.jerk_peak, rel=0.02)
    assert one.back_out.jerk_peak == pytest.approx(-one.tip_in.jerk_peak, rel=0.02)
    assert one.time[np.argmax(np.diff(one.traces["drive_torque"]) > 0)] == pytest.approx(0.0, abs=1e-9)
    # The jerk is the acceleration's slope: the shafts' torques hold nothing back.
    slope = np.gradient(one.traces["acceleration"], one.time)
    assert np.max(np.abs(slope - one.traces["jerk"])[2:-2]) < 0.02 * np.max(np.abs(one.traces["jerk"]))


def test_ringing_is_read_from_under_a_trend():
    time = np.arange(120) * 0.005
    slow = 40.0 - 8.0 * np.exp(-time / 0.4) + 3.0 * np.exp(-1.5 * time) * np.sin(8.0 * time)
    weak = 0.5 * np.exp(-30 * time) * np.sin(180.0 * time)
    s = complex(-12.0, 2 * np.pi * 11.0)
    found = ringing(slow + weak + 5.0 * np.exp(s.real * time) * np.cos(s.imag * time + 0.4), 0.005)
    assert found.frequency == pytest.approx(11.0, rel=1e-3)
    assert found.damping == pytest.approx(-s.real / abs(s), rel=1e-2)
    assert ringing(np.exp(-time), 0.005) is None
