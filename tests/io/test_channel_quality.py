"""Faults of a channel are found; rest, plateaus, quantization, switches and slow sensors are not faults."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from vdyn_cli.io.quality.channel_quality import Quality, check_channel
from vdyn_cli.quantities.log import Log, LogSource

Array = NDArray[np.float64]
N = 4000
T = np.arange(N) * 0.01


def one_channel(name: str, values: Array) -> Log:
    """A log as read, whose first sample is on the file's second line."""
    values = np.asarray(values, dtype=float)
    source = LogSource({name: "x"}, lambda row: row + 2)
    return Log("run.csv", np.arange(values.size, dtype=float), {name: values}, source=source)


def check(values: Array, unit: str = "N") -> Quality:
    return check_channel(one_channel("height", values), "height", unit)


def said(values: Array, unit: str = "N") -> str:
    quality = check(values, unit)
    return "\n".join(str(f) for f in (*quality.findings, *quality.problems))


def drive(seed: int = 0) -> Array:
    """A speed in m/s that accelerates, cruises, brakes and stands."""
    rng = np.random.default_rng(seed)
    pedal = np.repeat(rng.choice([-2.0, 0.0, 0.0, 1.5], 20), N // 20)
    speed = np.zeros(N)
    for i in range(1, N):
        speed[i] = max(speed[i - 1] + 0.01 * pedal[i], 0.0)
    return speed


def load(seed: int = 0) -> Array:
    """A wheel load excited by the road."""
    rng = np.random.default_rng(seed)
    return 4000.0 + 600.0 * np.sin(9.0 * T) * np.sin(1.1 * T + seed) + rng.normal(0.0, 8.0, N)


LEGITIMATE = {
    "constant zero": np.zeros(N),
    "constant": np.full(N, 0.012),
    "noise": np.random.default_rng(1).normal(size=N),
    "load": load(),
    "load of an 8-bit converter": np.round(load() / 10.0) * 10.0,
    "speed": drive() + np.random.default_rng(2).normal(0, 0.01, N),
    "speed without noise": drive(),
    "speed of 0.01 km/h": np.round(drive() * 3.6, 2),
    "speed of 1 km/h": np.round(drive() * 3.6),
    "gear": np.round(drive() / 4.0),
    "brake switch": (drive() < 3.0).astype(float),
    "pedal at its stops": 100.0 * (np.sin(T) > 0.3),
    "hill in whole metres": np.round(500.0 + 30.0 * np.sin(0.2 * T)),
    "hill in tenths": np.round(500.0 + 30.0 * np.sin(0.2 * T), 1),
    "sine": np.round(np.sin(T), 4),
    "slow temperature": np.round(20.0 + T / 10.0, 1),
    "temperature of half degrees, interpolated": np.interp(
        T, [0, 9, 9.1, 20, 20.1, 31, 31.1, 40], [20, 20, 20.5, 20.5, 20, 20, 21, 21]
    ),
    "torque that rests": np.where(
        np.sin(0.9 * T) > 0.2, 120 * np.sin(3 * T) + np.random.default_rng(8).normal(0, 1, N), 3.5
    ),
    "limited torque, smoothly": 250.0 * np.tanh(2.0 * np.sin(0.7 * T)),
    "cruise at the top": np.round(np.minimum(drive() * 8.0, 130.0) + np.random.default_rng(6).normal(0, 0.02, N), 2),
}


@pytest.mark.parametrize("name", LEGITIMATE)
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_legitimate_channels_are_silent(name: str, sign: float) -> None:
    assert said(sign * LEGITIMATE[name], "%" if "pedal" in name else "N") == ""


@pytest.mark.parametrize("seed", range(5))
@pytest.mark.parametrize("quantum", [0.0, 0.5, 10.0])
def test_clipped_peaks_are_named_with_their_limit(seed: int, quantum: float) -> None:
    values = np.clip(load(seed), None, 4300.0)
    if quantum:
        values = np.round(values / quantum) * quantum
    text = said(values)
    assert "is at its largest value, 4300 N" in text
    assert "clipped" in text
    assert "smallest" not in text
    assert "is at its smallest value, -4300 N" in said(-values)


def test_one_clipped_bump_is_enough() -> None:
    values = 4000.0 + 3000.0 * np.exp(-(((T - 20.0) / 0.5) ** 2)) + np.random.default_rng(4).normal(0, 5, N)
    text = said(np.minimum(values, 6000.0))
    assert "6000 N, once" in text
    lines = np.flatnonzero(values >= 6000.0) + 2
    assert f"lines {lines[0]} to {lines[-1]}" in text


def test_what_stands_long_at_its_largest_value_may_be_frozen() -> None:
    values = 20.0 + np.minimum(T, 10.0) + np.random.default_rng(4).normal(0, 0.02, N)
    top = int(np.argmax(values[1500:2500])) + 1500
    values[top : top + 1200] = values.max() + 0.01
    assert "frozen, or clipped" in said(np.round(values, 2))


def test_rest_at_zero_is_not_clipping() -> None:
    assert said(np.maximum(load() - 4200.0, 0.0)) == ""


@pytest.mark.parametrize("moving", [0.0, 5.0])
def test_a_brake_that_holds_the_standing_car_is_not_clipped(moving: float) -> None:
    """At 794 N m in two stops; while the car moves, the same is a limit of the sensor."""
    pressed = np.clip(2000.0 * np.sin(2.0 * np.pi * T / 20.0), 0.0, 794.0)
    speed = np.where(pressed > 0.0, moving, 15.0)
    log = Log("run.csv", T, {"brake_torque": pressed, "speed": speed})
    found = check_channel(log, "brake_torque", "N m").findings
    assert any("clipped" in f.what for f in found) == (moving > 0.0)


def test_missing_values_are_counted_and_placed() -> None:
    values = load()
    values[:300] = np.nan
    values[1000:1003] = np.nan
    text = said(values)
    assert "has no value in 303 of 4000 rows (7.6 %), 2 times, longest: lines 2 to 301" in text
    assert not check(values).problems


def test_mostly_missing_or_empty_is_a_problem() -> None:
    values = load()
    values[1000:3500] = np.nan
    assert check(values).problems
    assert "is empty" in said(np.full(N, np.nan))


@pytest.mark.parametrize("every", [2, 5, 10])
def test_a_held_slower_sensor_is_recognised(every: int) -> None:
    assert f"changes only once in {every} rows" in said(np.repeat(load()[::every], every)[:N])


def test_few_values_are_no_ground_for_findings() -> None:
    assert said(np.array([1.0, 2.0])) == ""
    assert said(np.arange(30.0)) == ""


@pytest.mark.parametrize(("channel", "told"), [("speed", True), ("drive_torque", False)])
def test_a_sensor_that_holds_one_value_all_through_did_not_measure(channel: str, told: bool) -> None:
    found = check_channel(one_channel(channel, np.full(500, 12.3)), channel, "N m").findings
    assert [f.fault for f in found] == [True] * told
    assert not check_channel(one_channel(channel, np.zeros(500)), channel, "N m").findings
