"""``vdyn init``: which parts of a long log are coast-downs, by its speed and by the signals of the drive."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.commands.drafts import draft, table


def test_each_coast_down_of_a_long_log_is_a_run(tmp_path: Path) -> None:
    """A logger left running: out and back in one file, with braking and a stop between, each with its own heading."""
    legs = [np.linspace(25.0, 6.0, 400), np.linspace(6.0, 0.0, 20), np.zeros(100), np.linspace(0.0, 25.0, 80)]
    speed = np.concatenate([*legs, *legs[:3], legs[3], *legs[:3]])
    heading = np.repeat([30.0, 210.0, 30.0], [550, 600, speed.size - 1150])
    columns_ = {"time_s": np.arange(speed.size) / 4.0, "speed_mpers": speed, "Heading_deg": heading}
    found, description = draft("coastdown", table(tmp_path / "long.csv", **columns_))
    assert "remove those that were braked or driven" in found.text
    runs = description["runs"]
    assert [run["direction"] for run in runs] == ["out", "back", "out"]
    windows = [[float(run[key].split()[0]) for key in ("from_time", "to_time")] for run in runs]
    assert np.all(np.diff(np.ravel(windows)) >= 0.0)
    assert [begin for begin, _ in windows] == pytest.approx([0.0, 145.0, 295.0], abs=5.0)
    assert all(105.0 <= end - 150.0 * k <= 130.0 for k, (_, end) in enumerate(windows))  # in the rest


def stop_and_go() -> tuple[np.ndarray, np.ndarray]:
    """Speed, m/s, at 4 Hz, and whether the car is driven: two coast-downs, a longer eased one, one with the engine."""
    up, stop, ends = np.linspace(0.0, 25.0, 80), np.zeros(100), np.linspace(6.0, 0.0, 20)
    falls = [np.linspace(25.0, 6.0, n) for n in (400, 900, 404, 250)]
    free = np.concatenate([np.r_[up, fall, ends, stop] for fall in falls])
    driven = np.concatenate([np.r_[up > -1.0, np.full(n, n in (900, 250)), ends > -1.0, stop > 0.0]
                             for n in (400, 900, 404, 250)])  # fmt: skip
    return free, driven


@pytest.mark.parametrize(
    ("signal", "on", "why"),
    [
        ("Accelerator Pedal_%", 20.0, "the pedal is pressed"),
        ("Gear_", 4.0, "a gear is engaged"),
        ("Brake Pressure_bar", 5.0, "the brake is applied"),
        ("Engine Speed_rpm", 1100.0, "the engine turns faster than at rest"),
    ],
)
def test_driven_parts_of_a_log_are_no_coast_downs(signal: str, on: float, why: str, tmp_path: Path) -> None:
    speed, driven = stop_and_go()
    values = driven * on + (800.0 if "Engine" in signal else 0.0)
    found, description = draft(
        "coastdown",
        table(tmp_path / "all.csv", time_s=np.arange(speed.size) / 4.0, speed_mpers=speed, **{signal: values}),
    )
    begins = [float(run["from_time"].split()[0]) for run in description["runs"]]
    assert begins == pytest.approx([15.0, 440.0], abs=8.0)
    assert found.text.count(f"left out: not a coast-down: {why}") == 2
    assert "mean decelerations of the runs: 0.19, 0.19 m/s^2" in found.text
    assert "which parts are coast-downs" not in found.undecided


def test_an_idling_engine_s_throttle_and_gear_changes_show_no_drive(tmp_path: Path) -> None:
    """The throttle of an idling engine is 15 % open, and closed with the engine's drag; 0 between two gears."""
    speed, driven = stop_and_go()
    throttle = np.where(driven, 5.0, 15.0)
    throttle[:80] = 80.0
    gear = np.where(np.arange(speed.size) % 80 < 2, 0.0, 4.0)
    log = table(
        tmp_path / "all.csv", time_s=np.arange(speed.size) / 4.0, speed_mpers=speed, Throttle_=throttle, Gear_=gear
    )
    assert len(draft("coastdown", log)[1]["runs"]) == 4


@pytest.mark.parametrize("drift", [0.0, 0.1])
def test_the_noise_and_drift_of_a_brake_that_is_never_applied_show_no_drive(drift: float, tmp_path: Path) -> None:
    speed, _ = stop_and_go()
    time = np.arange(speed.size) / 4.0
    pressure = drift * time / time[-1] + 0.02 * np.random.default_rng(1).standard_normal(time.size)
    log = table(tmp_path / "all.csv", time_s=time, speed_mpers=speed, **{"Brake Pressure_bar": pressure})
    assert len(draft("coastdown", log)[1]["runs"]) == 4


@pytest.mark.parametrize(("signal", "runs"), [("Gear_", 2), ("Brake_Disc_FL_degC", 4), ("Brake Pad Wear_", 4)])
def test_a_number_for_no_gear_and_a_brake_s_temperature_show_no_drive(signal: str, runs: int, tmp_path: Path) -> None:
    """15 while no gear is engaged, as of a bus signal of four bits."""
    speed, driven = stop_and_go()
    values = np.where(driven, 4.0, 15.0) if "Gear" in signal else np.where(driven, 300.0, 80.0)
    log = table(tmp_path / "all.csv", time_s=np.arange(speed.size) / 4.0, speed_mpers=speed, **{signal: values})
    assert len(draft("coastdown", log)[1]["runs"]) == runs


def test_a_log_with_driven_parts_only_is_said_to_be_no_coast_down(tmp_path: Path) -> None:
    speed, driven = stop_and_go()
    pedal = 20.0 * (driven | (speed > 1.0))
    log = table(tmp_path / "all.csv", time_s=np.arange(speed.size) / 4.0, speed_mpers=speed, Throttle_=pedal)
    assert "all.csv: not a coast-down: each of 4 decreases of the speed was driven" in draft("coastdown", log)[0].text


def test_parts_without_signals_state_their_decelerations(tmp_path: Path) -> None:
    speed, _ = stop_and_go()
    found, description = draft(
        "coastdown", table(tmp_path / "all.csv", time_s=np.arange(speed.size) / 4.0, speed_mpers=speed)
    )
    assert len(description["runs"]) == 4
    assert "mean decelerations of the runs: 0.19, 0.08, 0.19, 0.31 m/s^2" in found.text
    assert "which parts are coast-downs" in found.undecided


def test_a_coast_of_a_long_ride_ends_where_its_speed_settles(tmp_path: Path) -> None:
    """The speed between two coasts stays below half of its range, falls slowly, and varies: that is no coast."""
    time = np.arange(0.0, 1400.0)
    speed = np.interp(time, [0, 60, 130, 1000, 1060, 1130, 1400], [20, 60, 22, 14, 60, 18, 16])
    speed += np.where((time > 130.0) & (time < 1000.0), 2.5 * np.sin(time / 9.0), 0.0)
    _, description = draft("coastdown", table(tmp_path / "ride.csv", Time_s=time, Speed_kmh=np.round(speed, 2)))
    windows = [[float(run[key].split()[0]) for key in ("from_time", "to_time")] for run in description["runs"]]
    assert [len(windows), *np.ravel(windows)] == pytest.approx(
        [2, 55.0, 150.0, 1055.0, 1165.0], abs=70.0
    )  # ends within a minute
