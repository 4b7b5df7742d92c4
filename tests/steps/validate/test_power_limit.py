"""Drives whose torque is a demand that the motor's power limits."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant.sensors import Array
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.power_limit import power_limits
from vdyn_cli.steps.validate.drives.segments import RunConditions, Segmentation, drive_segments
from vdyn_cli.steps.validate.drives.stated_motion import StatedMotion

MASS, RADIUS, STEP = 1700.0, 0.32, 0.05  # kg, m, s
STATED = StatedMotion(1.0 / (RADIUS * MASS), -160.0 / MASS, -0.9 / MASS, MASS)
Driven = tuple[Array, dict[str, Array], Array]


def drive(seed: int, power: float = np.inf, gain: float = 1.0, hills: float = 0.001) -> Driven:
    """A demand that changes every few seconds, of which the car receives at most ``power``, W; ``gain`` of its log."""
    rng = np.random.default_rng([17, seed])
    time = np.arange(0.0, 160.0, STEP)
    wanted = np.interp(time, np.cumsum(rng.uniform(2.0, 8.0, 60)), rng.uniform(-250.0, 1100.0, 60))  # N m at the wheels
    v, x, speed = 15.0, 0.0, np.empty(time.size)
    place, phase = rng.uniform(25.0, 200.0, 10), rng.uniform(0.0, 2 * np.pi, 10)
    for k in range(time.size):
        speed[k] = v
        hill = 9.81 * hills * np.sqrt(0.2) * np.sum(np.sin(x / place + phase))
        force = min(wanted[k] / RADIUS, power / max(v, 0.1))
        v = max(v + STEP * ((force - 160.0 - 0.9 * v**2) / MASS - hill), 3.0)
        x += STEP * v
    channels = {"speed": speed + 0.02 * rng.standard_normal(time.size), "brake_torque": np.zeros(time.size)}
    return time, channels, gain * wanted + 0.5 * rng.standard_normal(time.size)


@pytest.mark.parametrize(("gain", "hills"), [(1.0, 0.0), (1.0, 0.02), (0.8, 0.003), (3.0, 0.003)])
def test_hills_and_gains_are_no_limit(gain: float, hills: float) -> None:
    assert not any(
        one.beyond.any() for one in power_limits([drive(k, gain=gain, hills=hills) for k in range(3)], STATED)
    )


def test_a_limit_is_found_and_the_torque_above_it_is_left_out() -> None:
    drives = [drive(k, power=18e3) for k in range(3)]
    found = power_limits(drives, STATED)
    for one, (time, channels, torque) in zip(found, drives, strict=True):
        assert one.power == pytest.approx(18e3, rel=0.08)
        assert one.beyond[torque * channels["speed"] / RADIUS > 18e3].all()
        assert one.left_out < 0.8 * (time[-1] - time[0])
    (finding,) = found[0].finding("run.csv")
    assert "kW at the wheels" in finding.what
    assert finding.doubt


def test_a_limited_drive_is_simulated_below_the_limit_only() -> None:
    time, channels, torque = drive(1, power=18e3)
    log = Log("run.csv", time, {**channels, "drive_torque": torque}, ())
    segments, findings = drive_segments([log], [RunConditions()], Segmentation("road_load", motion=STATED))
    assert segments
    for s in segments:
        assert np.max(s.inputs["drive_torque"] * s.outputs["speed"]) / RADIUS < 18.5e3
    assert ["kW at the wheels" in f.what for f in findings] == [True]
