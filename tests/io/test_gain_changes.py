"""A gain that changes in the middle of a log is found in physically related channels; ordinary slip is not reported."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from tests.io.test_log_flags import N, T, day
from vdyn_cli.io.quality.cuts import suspect_findings, with_cuts
from vdyn_cli.io.quality.gain_changes import gain_change_findings, gain_changes
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import Flag


def log(**gains: float) -> Log:
    """A drive in which gains of some channels change at its middle."""
    channels = day()
    channels["front_load"] = np.round(8000.0 - 300.0 * channels["acceleration"], 0)
    channels["rear_load"] = np.round(7000.0 + 300.0 * channels["acceleration"], 0)
    for name, gain in gains.items():
        channels[name][N // 2 :] *= gain
    return Log("run.csv", T, channels)


def test_a_healthy_drive_has_no_change() -> None:
    assert gain_changes(log()) == ()


@pytest.mark.parametrize(
    ("channel", "tie"),
    [
        ("wheel_speed_fl", "wheel_speed_fl against speed"),
        ("acceleration", "acceleration against speed"),
        ("front_load", "the sum of the loads against its median"),
    ],
)
def test_a_gain_that_changes_by_a_tenth_is_found_where_it_changes(channel: str, tie: str) -> None:
    (found,) = gain_changes(log(**{channel: 1.1}))
    assert found.what == tie
    assert found.at == pytest.approx(T[N // 2], abs=1.5)
    (finding,) = gain_change_findings(log(**{channel: 1.1}))
    assert finding.fault
    before = log(**{channel: 1.1}).between(0.0, found.at - 0.5)
    assert not list(gain_change_findings(before)), "the remedy clears the message"


@pytest.mark.parametrize(("gain", "found"), [(1.0, []), (1.05, [12.0])])
def test_a_late_speed_at_the_release_of_the_pedal_is_no_change(gain: float, found: list[float]) -> None:
    """A race car accelerates for 3 s and coasts; the receiver's speed is 0.25 s late, the position is not."""
    rng, time = np.random.default_rng(3), np.arange(0.0, 40.0, 0.1)
    ends = np.array([[-1.0, 3.0, 20.0, 41.0], [19.0, 25.0, 13.0, 5.0]])
    place = np.cumsum(np.interp(time, *ends)) * 0.1
    read = np.interp(time - 0.25, *ends) + rng.normal(0.0, 0.03, time.size)
    read *= np.where(time > 12.0, gain, 1.0)
    changes = gain_changes(Log("coast.csv", time, {"speed": read, "position": np.round(place, 1)}))
    assert [one.at for one in changes] == [pytest.approx(at, abs=1.0) for at in found]


def test_noise_of_a_log_of_1_hz_is_no_change() -> None:
    time = np.arange(0.0, 70.0)
    push = -(0.12 + 0.00028 * np.linspace(25.0, 10.0, time.size) ** 2)
    for seed in range(20, 30):
        rng = np.random.default_rng(seed)
        speed = 25.0 + np.cumsum(push) + rng.normal(0.0, 0.03, time.size)
        channels = {"speed": speed, "acceleration": rng.normal(-0.2, 0.05, time.size)}
        assert gain_changes(Log("coast.csv", time, channels)) == ()


def truck(loud: float, quiet: float, gain: float = 1.0) -> Log:
    """Accelerations of a first and a second half (m/s^2), in which the accelerometer's gain changes; 0.03 m/s noise."""
    rng, time = np.random.default_rng(1), np.arange(0.0, 160.0, 0.1)
    felt = np.where(time < 80.0, loud, quiet) * np.sin(0.35 * time)
    speed = 15.0 + np.cumsum(felt) * 0.1 + rng.normal(0.0, 0.03, time.size)
    read = felt * np.where(time > 80.0, gain, 1.0) + rng.normal(0.0, 0.03, time.size)
    return Log("truck.csv", time, {"speed": speed, "acceleration": read})


def hilly(gain: float, late: float = 100.0) -> Log:
    """A drive of 200 s through hills of 3 %, in which the accelerometer's gain changes over ``late`` seconds."""
    rng, time = np.random.default_rng(7), np.arange(0.0, 200.0, 0.1)
    push = np.sin(0.9 * time) * np.sin(0.13 * time)
    speed = 15.0 + np.cumsum(push) * 0.1
    felt = push + 0.3 * np.sin(0.06 * time) + rng.normal(0.0, 0.03, time.size)
    felt *= 1.0 + (gain - 1.0) * np.clip((time - 100.0) / late + 0.5, 0.0, 1.0)
    return Log("hills.csv", time, {"speed": speed + rng.normal(0.0, 0.02, time.size), "acceleration": felt})


def test_a_change_of_a_tenth_is_found_in_hills_and_a_drift_is_none() -> None:
    (found,) = gain_changes(hilly(1.1, 0.1))
    assert found.factor == pytest.approx(1.1, abs=0.02)
    assert found.at == pytest.approx(100.0, abs=3.0)
    assert gain_changes(hilly(1.1, 200.0)) == ()
    assert gain_changes(hilly(1.0)) == ()


@pytest.mark.parametrize(("gain", "found"), [(1.0, []), (0.95, [60.0]), (1.04, [60.0])])
def test_a_noisy_position_shows_a_change_of_the_speed_by_4_percent(gain: float, found: list[float]) -> None:
    rng, time = np.random.default_rng(5), np.arange(0.0, 120.0, 0.1)
    speed = 20.0 - 0.12 * time
    place = np.cumsum(speed) * 0.1 + rng.normal(0.0, 0.5, time.size)
    read = speed * np.where(time > 60.0, gain, 1.0) + rng.normal(0.0, 0.03, time.size)
    changes = gain_changes(Log("coast.csv", time, {"speed": read, "position": place}))
    assert [one.at for one in changes] == [pytest.approx(at, abs=6.0) for at in found]


def test_a_speed_that_jumps_against_its_acceleration_changes_its_gain() -> None:
    """The ratio to the acceleration does not show a change by 3 %; a wrong fix, which jumps back, is none."""
    healthy = hilly(1.0)
    for gain, until, found in ((1.03, 300.0, [100.0]), (1.03, 104.0, []), (1.0, 300.0, [])):
        within = (healthy.time > 100.0) & (healthy.time < until)
        read = healthy["speed"] * np.where(within, gain, 1.0)
        changes = gain_changes(healthy.with_channels(speed=read))
        assert [one.at for one in changes] == [pytest.approx(at, abs=1.0) for at in found]
        assert [one.factor for one in changes] == [pytest.approx(0.97, abs=0.01) for _ in found]


def test_a_quiet_half_in_which_the_speed_is_mostly_noise_is_no_change_of_the_accelerometer() -> None:
    assert gain_changes(truck(0.4, 0.06)) == ()
    (found,) = gain_changes(truck(1.0, 1.0, 1.2))
    assert found.factor == pytest.approx(1.2, abs=0.05)


def test_slip_that_comes_and_goes_is_no_change() -> None:
    healthy = log()
    slipping = healthy["wheel_speed_fl"] * (1.0 + 0.04 * np.sin(0.3 * T) ** 2)
    assert gain_changes(healthy.with_channels(wheel_speed_fl=slipping)) == ()


def test_a_speed_that_jumps_for_good_is_suspect_from_there_on() -> None:
    channels = {"speed": day()["speed"]}
    channels["speed"][2500:] *= 1.1
    cut = with_cuts(Log("run.csv", T, channels))
    states = cut.flags.states["speed"]
    assert set(states[:2500].tolist()) == {Flag.GOOD}
    assert set(states[2500:].tolist()) == {Flag.SUSPECT}
    assert not np.isnan(cut.log["speed"]).any(), "which side is wrong is not known"
    (finding,) = suspect_findings(cut)
    assert "to_time: 50 s" in finding.remedy
    assert not list(suspect_findings(cut.between(0.0, 49.98)))


def test_a_car_that_brakes_hard_does_not_jump() -> None:
    speed = np.round(np.clip(30.0 - 12.0 * (T - 40.0), 0.0, 30.0) + 0.02 * np.random.default_rng(1).normal(size=N), 2)
    assert flags(replace(log(), channels={"speed": np.abs(speed)})).faults == ()


def test_a_wheel_that_slips_while_the_car_speeds_up_is_no_change() -> None:
    healthy = log()
    rate = np.gradient(healthy["speed"], T)
    slipping = healthy["wheel_speed_fl"] * (1.0 + 0.04 * np.clip(rate, 0.0, None) / max(rate.max(), 1.0))
    assert gain_changes(healthy.with_channels(wheel_speed_fl=slipping)) == ()


@pytest.mark.parametrize("seed", [7, 203])
def test_hills_that_happen_to_follow_the_acceleration_are_no_change(seed: int) -> None:
    """A specific force contains the slope, whose hills last for many windows."""
    rng, time = np.random.default_rng(seed), np.arange(0.0, 420.0, 0.1)
    knots = np.r_[0.0, np.cumsum(rng.uniform(15.0, 50.0, 60))]
    speed = np.interp(time, knots, np.r_[0.0, rng.uniform(4.0, 20.0, 60)])
    speed = np.convolve(np.pad(speed, 10, "edge"), np.ones(21) / 21, "valid")
    waves = zip(rng.uniform(0.0025, 0.018, 8), rng.uniform(0.0, 6.28, 8), strict=True)  # rad/m: hills of 350 to 2500 m
    along = np.cumsum(speed) * 0.1
    slope = sum(0.014 * rng.normal() * np.sin(along * w + p) for w, p in waves)
    felt = np.gradient(speed, time) + 9.81 * slope + rng.normal(0.0, 0.05, time.size)
    read = speed + rng.normal(0.0, 0.03, time.size)
    assert gain_changes(Log("hills.csv", time, {"speed": read, "acceleration": felt})) == ()


def test_a_valley_in_a_short_drive_is_no_change() -> None:
    """Down while it accelerates, up while it brakes and accelerates again: like a gain that increases at the stop."""
    time = np.arange(0.0, 90.0, 0.1)
    speed = np.interp(
        time, [2.0, 16.0, 22.0, 40.0, 46.0, 72.0, 80.0, 90.0], [0.0, 20.0, 20.0, 0.0, 0.0, 18.0, 18.0, 3.0]
    )
    slope = np.interp(time, [16.0, 22.0, 36.0, 60.0, 90.0], [-0.010, 0.007, 0.013, 0.013, -0.010])
    noise = np.random.default_rng(8).normal(0.0, 0.05, time.size)
    felt = np.gradient(speed, time) + 9.81 * slope + noise
    assert gain_changes(Log("valley.csv", time, {"speed": speed, "acceleration": felt})) == ()


def test_the_brake_at_the_end_of_a_coast_at_1_hz_is_no_change_of_a_gain() -> None:
    """Braked within one window of 4 s, over which an acceleration that is sampled once a second is summed wrongly."""
    time = np.arange(0.0, 230.0, 0.01)
    until = [time < 3.0, time < 10.0, time < 153.9, time < 156.2]
    forward = np.select(until, [1.9, 0.0, -0.08 - 8e-4 * (153.9 - time), -1.4], 0.0)
    speed = np.cumsum(forward) * 0.01
    noise = np.random.default_rng(3).standard_normal((2, 230))
    known = {"speed": np.interp(time[::100] - 0.5, time, speed - speed[-1]) + 0.05 * noise[0]}
    known["acceleration"] = forward[::100] + 0.03 * noise[1]
    assert gain_changes(Log("phone.csv", time[::100], known)) == ()
