"""The gain of an acceleration over the change of speed: mistaken units are named, slopes and noise are not accused."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.io.quality.cross_checks import with_cross_checks
from vdyn_cli.project.checks.redundancy import compared_over_runs, tied_pairs
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters

TIME = np.arange(0.0, 120.0, 0.1)


def coast(seed: int, gain: float, slope: float) -> Log:
    """A coast-down from 20 m/s on a road whose slope changes by ``slope`` in its course; the accelerometer measures
    the deceleration without gravity's component."""
    generator = np.random.default_rng(seed)
    speed, drag = [20.0], []
    for t in TIME:
        drag.append(0.08 + 0.0003 * speed[-1] ** 2)
        speed.append(speed[-1] - 0.1 * (drag[-1] + 9.80665 * slope * (t / TIME[-1] - 0.5)))
    noise = generator.standard_normal((2, TIME.size))
    measured = -gain * np.array(drag) + 0.005 * abs(gain) * noise[0]
    return Log(f"run{seed}", TIME, {"speed": np.array(speed[:-1]) + 0.005 * noise[1], "acceleration": measured})


@pytest.mark.parametrize(
    ("gain", "slope", "cause"),
    [
        (1.0, 0.0, ""),
        (1.0, 0.01, ""),
        (1.0, -0.004, ""),
        (1.0 / 9.80665, 0.0, "acceleration in g read as m/s^2"),
        (9.80665, 0.0, "acceleration in m/s^2 read as g"),
        (1.0 / 3.6, 0.0, "speed in km/h read as m/s"),
        (-1.0, 0.0, "add 'sign: -1'"),
    ],
)
def test_a_mistaken_unit_of_gentle_runs_is_named_and_a_slope_is_not(gain: float, slope: float, cause: str) -> None:
    logs = [coast(seed, gain, slope * (-1.0) ** seed) for seed in range(4)]
    pairs, findings = compared_over_runs([p for log in logs for p in tied_pairs(log, Parameters())])
    assert [cause in f.remedy for f in findings] == ([True] if cause else [])
    assert all((p.good is False) == bool(cause) for p in pairs)


def test_a_gain_that_is_no_unit_s_has_the_remedy_of_a_gain() -> None:
    rate = 1.5 * np.sin(0.5 * TIME)
    log = Log("a.csv", TIME, {"speed": 15.0 - 3.0 * np.cos(0.5 * TIME), "acceleration": 1.06 * rate})
    (found,) = with_cross_checks(log).findings
    assert "write 'scale: 0.943" in found.remedy
    assert "unit" not in found.remedy


@pytest.mark.parametrize(("gain", "tilts", "good"), [(1.12, True, True), (1.12, False, False), (1.3, True, False)])
def test_an_accelerometer_that_pitches_with_the_body_may_read_high(gain: float, tilts: bool, good: bool) -> None:
    """A soft car pitches by 7 degrees at 1 g, which adds 12 % of gravity's component to the acceleration."""
    rate = 1.5 * np.sin(0.5 * TIME)
    log = Log("a.csv", TIME, {"speed": 15.0 - 3.0 * np.cos(0.5 * TIME), "acceleration": gain * rate})
    (pair,) = tied_pairs(log, Parameters(), tilts=tilts)
    assert pair.good is good
    assert ("the body pitches by +6.9 deg at 1 g" in pair.what) == good


def test_slopes_that_scatter_the_acceleration_are_no_gain() -> None:
    """The ratio of the scatters is 1.05 to 1.06: slopes of 60 m raise it, and both regressions include 1."""
    time = np.arange(0.0, 900.0, 0.1)
    slopes = 0.36 * np.repeat(np.random.default_rng(1).standard_normal(time.size // 40), 40)
    rate = 1.05 * np.sin(0.5 * time)
    log = Log("a.csv", time, {"speed": 15.0 - 2.1 * np.cos(0.5 * time), "acceleration": rate + slopes})
    assert np.std(log["acceleration"]) > 1.05 * np.std(rate)
    assert not with_cross_checks(log).findings


@pytest.mark.parametrize(("gain", "logged", "wrong"), [(1.0, False, False), (1.0, True, False), (1.08, True, True)])
def test_hills_that_resemble_a_gain_are_not_accused_and_an_elevation_shows_a_gain(
    gain: float, logged: bool, wrong: bool
) -> None:
    """The car climbs where it accelerates and descends where it brakes, beside pulls of the engine on all slopes."""
    generator = np.random.default_rng(3)
    rate = 1.2 * np.sin(0.05 * TIME) + 0.9 * np.sin(1.3 * TIME)
    slope = 0.014 * np.sin(0.05 * TIME)
    speed = 5.0 + np.cumsum(rate) * 0.1
    height = np.cumsum(slope * speed) * 0.1 + 0.1 * generator.standard_normal(TIME.size)
    channels = {"speed": speed, "acceleration": gain * (rate + 9.80665 * slope)}
    found = with_cross_checks(Log("a.csv", TIME, channels | ({"elevation": height} if logged else {}))).findings
    assert bool(found) == wrong
    assert all("write 'scale: 0.92" in one.remedy for one in found)


def test_the_delay_of_an_acceleration_is_found_on_hills_with_an_elevation() -> None:
    """Slopes that last for some seconds disturb the comparison unless the elevation shows them."""
    generator = np.random.default_rng(5)
    rate = 0.9 * np.sin(0.7 * TIME + 2.0 * np.sin(0.21 * TIME))
    slope = 0.02 * np.sin(0.43 * TIME + 0.9 * np.sin(0.05 * TIME))
    speed = 14.0 + np.cumsum(rate) * 0.1
    height = np.cumsum(slope * speed) * 0.1 + 0.1 * generator.standard_normal(TIME.size)
    late = np.interp(TIME - 0.08, TIME - 0.05, rate + 9.80665 * slope)
    channels = {"speed": speed, "acceleration": late + 0.05 * generator.standard_normal(TIME.size)}
    pair = next(tied_pairs(Log("a.csv", TIME, channels | {"elevation": height}), Parameters()))
    assert pair.delay is not None
    assert pair.delay_std is not None
    assert abs(pair.delay - 0.08) < 3.0 * pair.delay_std < 0.03
