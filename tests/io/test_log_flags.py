"""Faulty samples get the state failed with the test that says so; rest, quantization and switches do not."""

from __future__ import annotations

import time

import numpy as np
import pytest
from numpy.typing import NDArray

from tests.io.test_channel_quality import LEGITIMATE, drive
from vdyn_cli.io.quality.log_flags import flags
from vdyn_cli.io.quality.regular_segments import rounded_line
from vdyn_cli.io.quality.spikes import spikes
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quality_flags import EVERY, Flag

Array = NDArray[np.float64]
N = 4000
T = np.arange(N) * 0.02


def day(seed: int = 0, decimals: int = 3) -> dict[str, Array]:
    """A drive in several channels, written with some number of decimals."""
    rng = np.random.default_rng(seed)
    speed = 15.0 + 6.0 * np.sin(0.2 * T + seed) + 2.0 * np.sin(0.7 * T)
    clean = {
        "speed": speed,
        "wheel_speed_fl": speed / 0.31,
        "acceleration": np.gradient(speed, T),
        "drive_torque": 300.0 + 200.0 * np.sin(0.4 * T),
        "elevation": np.round(500.0 + 0.1 * np.cumsum(speed) * 0.02 / 50.0),
    }
    noise = {"speed": 0.02, "wheel_speed_fl": 0.05, "acceleration": 0.05, "drive_torque": 2.0, "elevation": 0.0}
    return {n: np.round(v + rng.normal(0.0, noise[n] + 1e-12, N), decimals) for n, v in clean.items()}


def found(channels: dict[str, Array]) -> list[tuple[str, str, int, int]]:
    """Channel, test, first sample and the one after the last, of each fault."""
    faults = flags(Log("run.csv", T, channels)).faults
    return [(f.channel, f.test, f.first, f.stop) for f in faults]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("decimals", [3, 1])
def test_a_healthy_drive_has_no_faults(seed: int, decimals: int) -> None:
    assert found(day(seed, decimals)) == []


NAMED = {"gear": "gear", "brake switch": "brake", "pedal at its stops": "pedal", "torque that rests": "drive_torque"}
PLACES = {n: "elevation" for n in LEGITIMATE if n.startswith(("hill", "temperature", "slow"))}
COMMANDED = {"limited torque, smoothly": "drive_torque", "constant": "drive_torque", "constant zero": "brake_torque"}


@pytest.mark.parametrize("name", LEGITIMATE)
def test_rest_quantization_and_switches_are_no_faults(name: str) -> None:
    channel = (NAMED | PLACES | COMMANDED).get(name, "speed" if "speed" in name or "cruise" in name else "front_load")
    values = np.asarray(LEGITIMATE[name], dtype=float)
    assert flags(Log("run.csv", T, {channel: values})).faults == ()


def test_a_log_without_noise_is_no_fault() -> None:
    ramp = np.where(T < 30.0, 20.0 - T / 3.0, 10.0)
    assert found({"speed": ramp, "wheel_speed_fl": ramp / 0.3}) == []


def test_a_smooth_speed_that_freezes_while_the_car_moves_jumps_at_the_end() -> None:
    values = np.round(20.0 + 8.0 * np.sin(0.3 * T), 3)
    values[2000:2300] = values[2000]
    assert found({"speed": values}) == [("speed", "frozen", 2000, 2300)]


@pytest.mark.parametrize("channel", ["speed", "wheel_speed_fl", "acceleration", "drive_torque"])
@pytest.mark.parametrize("length", [50, 600])
def test_a_frozen_channel_is_found_from_its_first_to_its_last_sample(channel: str, length: int) -> None:
    channels = day()
    channels[channel][1500 : 1500 + length] = channels[channel][1500]
    assert found(channels) == [(channel, "frozen", 1500, 1500 + length)]


@pytest.mark.parametrize("length", [8, 50, 2400])
def test_a_frozen_log_is_found_once(length: int) -> None:
    channels = day()
    for values in channels.values():
        values[1000 : 1000 + length] = values[1000]
    assert found(channels) == [(EVERY, "frozen", 1000, 1000 + length)]


@pytest.mark.parametrize("length", [25, 50, 2400])
def test_a_gap_that_the_logger_filled_with_straight_lines_is_found(length: int) -> None:
    channels = day()
    for values in channels.values():
        values[1000 : 1000 + length] = np.round(np.linspace(values[1000], values[1000 + length], length), 3)
    ((channel, test, first, stop),) = found(channels)
    assert (channel, test) == (EVERY, "straight_line")
    assert abs(first - 1000) <= 2
    assert abs(stop - 1000 - length) <= 2


def test_a_straight_line_in_one_channel_is_found() -> None:
    channels = day()
    channels["acceleration"][700:900] = np.round(np.linspace(-1.0, 2.0, 200), 3)
    ((channel, test, first, stop),) = found(channels)
    assert (channel, test) == ("acceleration", "straight_line")
    assert abs(first - 700) + abs(stop - 900) <= 3


SCATTERED = (102, 101, 99.5, 98, 96.5, 94.5, 93, 91.5, 90.5, 88.5, 87.5, 86, 84.5, 83, 82, 80.5, 79.5)
IDLING = (-0.5, 0, 0, 0, 0, -0.5, 0, -0.5, 0, -0.5, 0, 0, 0, 0, 0.5, 0)


@pytest.mark.parametrize("values", [SCATTERED, IDLING])
def test_a_slow_torque_in_coarse_steps_is_no_rounded_line(values: tuple[float, ...]) -> None:
    """Each value lies within a quantum of a line, but the steps between them differ by more than rounding does."""
    torque = np.array(values)
    rows = np.arange(torque.size, dtype=float)
    assert not rounded_line((0.1 * rows, rows), torque, 0.5)
    filled = np.round(np.interp(rows, rows[[0, 6, -1]], [102.0, 97.3, 79.5]) / 0.5) * 0.5
    assert rounded_line((0.1 * rows, rows), filled, 0.5)


def test_a_steady_speed_of_coarse_resolution_is_no_gap() -> None:
    """A bus: steps of 0.1 km/h, held for two samples, without noise; the cruise of 30 s varies by two steps."""
    time = 0.1 * np.arange(2000)
    cruise, town = 5.0 + 0.02 * np.sin(0.4 * time), 5.0 + 3.0 * np.sin(0.5 * time) + np.sin(1.3 * time)
    held = np.where((time > 60.0) & (time < 90.0), cruise, town)[(np.arange(time.size) // 2) * 2]
    step = 0.1 / 3.6
    assert not flags(Log("bus.csv", time, {"speed": np.round(held / step) * step})).faults


def test_a_parked_car_is_at_rest_and_not_frozen() -> None:
    channels = day()
    channels["speed"][2000:] = channels["wheel_speed_fl"][2000:] = 0.0
    channels["acceleration"][2100:] = 0.05
    channels["drive_torque"][2000:] = 0.0
    assert found(channels) == []


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("channel", ["speed", "acceleration", "drive_torque"])
def test_a_single_wrong_sample_is_found(channel: str, seed: int) -> None:
    channels, rng = day(seed), np.random.default_rng(seed)
    at = int(rng.integers(100, N - 100))
    channels[channel][at] += 20.0 * {"speed": 0.02, "acceleration": 0.05, "drive_torque": 2.0}[channel]
    assert found(channels) == [(channel, "spike", at, at + 1)]


@pytest.mark.parametrize(("right", "cut"), [(22.5, 0), (-22.5, 2), (0.0, 1)])
def test_a_spike_of_both_wheels_is_real(right: float, cut: int) -> None:
    channels, rng, at = day(), np.random.default_rng(8), 700
    torque = channels.pop("drive_torque")
    channels |= {f"drive_torque_{side}": torque / 2.0 + rng.normal(0.0, 1.0, N) for side in ("left", "right")}
    channels["drive_torque_left"][at] += 25.0
    channels["drive_torque_right"][at] += right
    assert len(found(channels)) == cut


def test_a_dropout_to_zero_is_found_and_a_stop_is_not() -> None:
    values = drive() + 5.0
    values += np.random.default_rng(3).normal(0.0, 0.01, N)
    channels = {"speed": np.round(values, 3)}
    channels["speed"][800:830] = 0.0
    assert found(channels) == [("speed", "dropout", 800, 830)]
    stopping = np.round(np.maximum(15.0 - np.abs(T - 40.0), 0.0), 2)
    assert found({"speed": stopping}) == []


def test_peaks_at_a_sensor_s_limit_and_samples_after_a_gap_are_suspect() -> None:
    channels = {
        "front_load": np.minimum(4000.0 + 600.0 * np.sin(2.0 * T) + np.random.default_rng(0).normal(0, 8.0, N), 4300.0)
    }
    keep = np.delete(np.arange(N), np.s_[2000:2010])
    log = Log("run.csv", T[keep], {n: v[keep] for n, v in channels.items()})
    found = flags(log)
    assert {f.test for f in found.faults} == {"saturated", "clock_gap"}
    limit = log["front_load"] == 4300.0
    assert np.mean(found.states["front_load"][limit] == Flag.SUSPECT) > 0.9
    assert np.all(found.states["front_load"][~limit] == Flag.GOOD)
    assert np.flatnonzero(found.states["time"] == Flag.SUSPECT).tolist() == [2000]
    assert [f.test for f in found.faults if f.first <= 2000 < f.stop] == ["clock_gap"]


def test_missing_samples_are_missing_and_short_channels_not_evaluated() -> None:
    channels = day()
    channels["speed"][100:120] = np.nan
    states = flags(Log("run.csv", T, channels)).states["speed"]
    assert np.all(states[100:120] == Flag.MISSING)
    assert np.all(np.delete(states, np.s_[100:120]) == Flag.GOOD)
    short = Log("run.csv", T[:40], {"speed": channels["speed"][:40]})
    assert set(flags(short).states["speed"].tolist()) == {Flag.NOT_EVALUATED}


def test_a_minute_at_1_khz_takes_far_less_than_a_second() -> None:
    rng, n = np.random.default_rng(0), 60_000
    names = ("speed", "acceleration", "front_load", "rear_load", "pitch_rate", "hub_torque")
    log = Log("run.csv", np.arange(n) / 1000.0, {name: np.round(rng.normal(20.0, 1.0, n), 3) for name in names})
    begun = time.process_time()
    flags(log)
    assert time.process_time() - begun < 0.8


@pytest.mark.parametrize("wheel", [False, True])
@pytest.mark.parametrize("held", [1, 20])
def test_a_stop_that_a_slow_receiver_sees_as_one_step_is_no_fault(held: int, wheel: bool) -> None:
    """A speed at 1 Hz, also written at 20 Hz: braking reduces it by 2.8 m/s between two readings."""
    rng, radius = np.random.default_rng(8), 0.3 if wheel else 1.0
    falling = 3.75 + 21.0 * (1.0 - np.arange(120) / 120.0) ** 1.5 + rng.normal(0.0, 0.03, 120)
    stop = np.concatenate([falling, [0.98], np.zeros(20)])
    assert "level_step" not in failed_tests(stop / radius, held, wheel)
    # A gain that changes while the car keeps rolling is found at both rates.
    changed = np.concatenate([falling[:60], 0.7 * falling[60:]])
    assert "level_step" in failed_tests(changed / radius, held, wheel)


@pytest.mark.parametrize("step", [0.1, 1.0])
def test_a_coarse_speed_that_rests_and_then_jumps_was_frozen(step: float) -> None:
    """A bus signal in steps of 0.1 or 1 km/h at 50 Hz repeats most values: rests alone are no fault in it."""
    time = np.arange(0.0, 120.0, 0.02)
    speed = np.round((60.0 + 25.0 * np.sin(time / 9.0)) / step) * step / 3.6
    frozen = (time > 30.0) & (time < 45.0)
    log = Log("run.csv", time, {"speed": np.where(frozen, speed[np.argmax(frozen)], speed)})
    (fault,) = flags(log, {"speed": "km/h"}).faults
    assert fault.test == "frozen"
    assert (time[fault.first], time[fault.stop]) == pytest.approx((30.0, 45.0), abs=0.3)
    assert not flags(Log("run.csv", time, {"speed": speed})).faults


def test_a_speed_that_falls_while_the_log_has_a_gap_has_no_jump() -> None:
    rng, time = np.random.default_rng(3), np.arange(0.0, 120.0, 0.05)
    speed = 30.0 - 0.2 * time + rng.normal(0.0, 0.01, time.size)
    there = (time < 40.0) | (time > 44.0)
    failed = {fault.test for fault in flags(Log("run.csv", time[there], {"speed": speed[there]})).faults}
    assert "level_step" not in failed
    assert "clock_gap" in failed
    jumped = np.where(time < 40.0, speed, speed - 1.0)
    assert "level_step" in {fault.test for fault in flags(Log("run.csv", time, {"speed": jumped})).faults}


def failed_tests(values: Array, held: int, wheel: bool) -> set[str]:
    """The tests that a speed at 1 Hz fails if each value is written several times."""
    time = np.arange(values.size * held) / held
    log = Log("run.csv", time, {"wheel_speed" if wheel else "speed": np.repeat(values, held)})
    return {fault.test for fault in flags(log).faults}


@pytest.mark.parametrize("seed", range(3))
def test_the_end_of_an_acceleration_is_no_spike(seed: int) -> None:
    """A receiver of 1 Hz shows the change to coasting as one corner; a wrong sample of that size elsewhere is found."""
    time = np.arange(120.0)
    speed = np.interp(time, [8.0, 26.0], [0.0, 31.0]) - 0.28 * np.maximum(time - 26.0, 0.0)
    speed += 0.04 * np.random.default_rng(seed).standard_normal(time.size)
    assert spikes(speed, 0.001).size == 0
    speed[70] += 2.0
    assert spikes(speed, 0.001).tolist() == [70]


@pytest.mark.parametrize("samples", [2, 4, 9])
def test_a_short_pulse_of_a_speed_is_a_dropout_and_a_fast_drive_is_not(samples: int) -> None:
    channels = day()
    channels["speed"][2000 : 2000 + samples] += 4.0
    assert [f for f in found(channels) if f[0] == "speed"] == [("speed", "dropout", 2000, 2000 + samples)]
    channels["speed"][2000:2100] += np.where(np.arange(100) < samples, 0.0, 4.0)  # now a longer segment
    assert ("speed", "dropout") not in [f[:2] for f in found(channels)]


def test_a_speed_sensor_that_reads_no_creeping_car_is_no_fault() -> None:
    """Below 0.6 m/s it reads zero, which is a jump at every stop."""
    rng = np.random.default_rng(3)
    speed = np.abs(12.0 * np.sin(0.15 * T)) + rng.normal(0.0, 0.01, N)
    speed[1000:1400] = 0.58 + rng.normal(0.0, 0.02, 400)  # creeping
    read = np.round(np.where(speed < 0.6, 0.0, speed), 3)
    assert found({"speed": read, "wheel_speed_fl": read / 0.3}) == []
    read[500:520] = 0.0
    assert ("speed", "dropout", 500, 520) in found({"speed": read})


@pytest.mark.parametrize("seed", [1, 4, 5])
def test_a_coarse_speed_rests_at_a_constant_true_speed_and_jumps_after_it_was_frozen(seed: int) -> None:
    """Steps of 0.0625 km/h with 29 % of that as noise: at a constant speed, eleven of twelve readings repeat."""
    rng = np.random.default_rng(seed)
    step = 0.0625 / 3.6
    cruise = np.clip(T - 30.0, 0.0, 1.6)
    driven = T - cruise
    speed = 15.0 + 6.0 * np.sin(0.2 * driven) + 2.0 * np.sin(0.7 * driven)
    speed += np.round(speed[1500] / step) * step - speed[1500]
    speed = np.round((speed + rng.normal(0.0, step / 3.5, N)) / step) * step
    assert found({"speed": speed}) == []
    speed[2500:2600] = speed[2500]
    assert [(c, t) for c, t, *_ in found({"speed": speed})] == [("speed", "frozen")]


def test_a_brake_of_50_hz_held_in_a_log_of_100_hz_is_no_gap() -> None:
    """Without noise, in steps of 4 N m; a long application rises nearly linearly. Held ramps are no noise."""
    time = np.arange(5000) * 0.02
    brake = np.zeros(time.size)
    for begin, length in ((8.0, 1.0), (20.0, 1.0), (40.0, 6.0), (60.0, 1.0), (70.0, 1.1), (80.0, 1.0), (90.0, 1.0)):
        since = np.clip(time - begin, 0.0, None)
        rise = np.where(since < length, (1.0 - np.exp(-since / 0.2)) * (300.0 + 6.0 * since), 0.0)
        brake += rise * np.clip((length - since) / 0.3, 0.0, 1.0)
    held = np.repeat(np.round(brake / 4.0) * 4.0, 2)
    fast = np.arange(held.size) * 0.01
    channels = {"speed": 15.0 + 5.0 * np.sin(fast / 9.0), "brake_torque": held}
    assert flags(Log("run.csv", fast, channels)).faults == ()
