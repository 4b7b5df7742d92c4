"""The simulated segments of a log, their regimes and start speeds."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.steps.validate.validate_cases import inputs, true_parameters
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.end_speed import end_speed
from vdyn_cli.steps.validate.drives.regimes import REGIMES
from vdyn_cli.steps.validate.drives.segments import RunConditions, Segmentation, drive_segments
from vdyn_cli.steps.validate.problem import ValidateProblem

TIME = np.arange(0.0, 60.0, 0.1)
# Stands, accelerates, cruises, coasts, brakes, stands.
SPEED = np.interp(TIME, [0, 3, 13, 33, 48, 54, 60], [0, 0, 20, 20, 17, 0, 0])
TORQUE = np.where((TIME > 3) & (TIME <= 13), 300.0, np.where((TIME > 13) & (TIME <= 33), 40.0, 0.0))
BRAKE = np.where((TIME > 48) & (TIME <= 55), 1500.0, 0.0)
RECUPERATED = np.where((TIME > 48) & (TIME <= 54), -430.0, TORQUE)  # the motor does the braking


def log(**changed: np.ndarray) -> Log:
    return Log("a.csv", TIME, {"speed": SPEED, "drive_torque": TORQUE, "brake_torque": BRAKE, **changed})


def test_regimes_are_what_the_car_does() -> None:
    (s,), _ = drive_segments([log()], [RunConditions("out")], Segmentation("vehicle"))
    at = {t: REGIMES[s.marks[np.searchsorted(s.time, t)]] for t in (1.0, 4.0, 10.0, 20.0, 40.0, 51.0, 58.0)}
    assert list(at.values()) == ["low speed", "launch", "acceleration", "cruise", "coast", "braking", "low speed"]
    assert s.heading == 1.0


def test_a_mass_on_a_road_is_simulated_where_it_moves_and_nobody_brakes() -> None:
    found, _ = drive_segments([log()], [RunConditions()], Segmentation("road_load"))
    assert [(round(s.time[0]), round(s.time[-1])) for s in found] == [(4, 48)]
    assert found[0].time[-1] < 48.0
    assert all(not s.inputs["brake_torque"].any() for s in found)


def test_parts_of_one_log_belong_to_it() -> None:
    """A cut made two runs of the log, which are divided into windows."""
    parts = [
        Log(f"a.csv, {span} s", TIME, {"speed": SPEED, "drive_torque": TORQUE, "brake_torque": BRAKE})
        for span in ("0.0 to 60.0", "70.0 to 130.0")
    ]
    found, _ = drive_segments(parts, [RunConditions(), RunConditions()], Segmentation("road_load", 10.0, True))
    assert {s.run for s in found} == {0, 1}
    assert {s.log for s in found} == {"a.csv"}


def test_a_speed_of_a_slower_logger_counts_once_for_each_of_its_samples() -> None:
    """Rows that are interpolated between two samples have less noise, and none of their own."""
    rng = np.random.default_rng(2)
    at = np.arange(0.03, 59.9, 0.5)
    read = np.interp(at, TIME, SPEED) + 0.1 * rng.standard_normal(at.size)
    slower = replace(log(speed=np.interp(TIME, at, read)), samples={"speed": (at, read)})
    (s,), _ = drive_segments([slower], [RunConditions()], Segmentation("vehicle"))
    there = np.isfinite(s.outputs["speed"])
    assert there.sum() == at.size
    assert np.abs(s.time[there] - at).max() < 0.051
    assert s.noise_levels["speed"] == pytest.approx(0.1, rel=0.3)


def test_powered_windows_follow_one_another() -> None:
    found, _ = drive_segments([log()], [RunConditions()], Segmentation("road_load", 10.0, True))
    assert len(found) == 2
    assert all(s.duration == pytest.approx(10.0, abs=0.11) for s in found)
    assert all((s.inputs["drive_torque"] > 0).all() for s in found)
    assert found[1].time[0] == pytest.approx(found[0].time[-1], abs=0.11)


def test_a_start_speed_is_read_from_the_second_beside_it() -> None:
    rng = np.random.default_rng(1)
    noisy = 10.0 + 0.5 * TIME + 0.1 * rng.standard_normal(TIME.size)
    value, std = end_speed(TIME, noisy, first=True)
    assert value == pytest.approx(10.0, abs=4 * std)
    assert 0.02 < std < 0.12
    value, std = end_speed(TIME, noisy, first=False)
    assert value == pytest.approx(10.0 + 0.5 * TIME[-1], abs=4 * std)


def test_a_torque_from_a_slower_logger_is_taken_as_straight_lines() -> None:
    sparse = np.where(np.arange(TIME.size) % 4 == 0, TORQUE, np.nan)
    sparse[-1] = 0.0
    (s,), _ = drive_segments([log(drive_torque=sparse)], [RunConditions()], Segmentation("vehicle"))
    assert np.isfinite(s.inputs["drive_torque"]).all()


def test_one_missing_torque_is_a_gap() -> None:
    holed = TORQUE.copy()
    holed[100] = np.nan
    with pytest.raises(InputError, match=r"1 values? (is|are) missing"):
        drive_segments([log(drive_torque=holed)], [RunConditions()], Segmentation("vehicle"))


def test_a_mass_on_a_road_is_simulated_between_the_gaps_of_its_inputs() -> None:
    """A dropout of the clock, one of the torque, and a single missing torque, which is interpolated."""
    kept = (TIME < 20.0) | (TIME > 21.0)
    holed = TORQUE.copy()
    holed[(TIME > 30.0) & (TIME < 30.9)] = np.nan
    holed[400] = np.nan
    whole = log(drive_torque=holed)
    dropped = Log("a.csv", TIME[kept], {name: values[kept] for name, values in whole.channels.items()})
    found, reported = drive_segments([dropped], [RunConditions()], Segmentation("road_load"))
    assert [(round(s.time[0], 1), round(s.time[-1], 1)) for s in found] == [(3.6, 19.9), (21.2, 30.0), (31.0, 47.6)]
    assert any("not known in 2 gaps of up to 1.2 s, the longest at 19.90 s" in f.what for f in reported)


def test_an_output_that_is_mostly_empty_is_left_out_and_reported() -> None:
    empty = np.full(TIME.size, np.nan)
    empty[:50] = 0.0
    (s,), reported = drive_segments([log(acceleration=empty)], [RunConditions()], Segmentation("vehicle"))
    assert "acceleration" not in s.outputs
    assert any("is empty in 92 % of the rows" in f.what for f in reported)


def test_a_log_that_begins_in_a_tip_in_begins_at_its_own_speed() -> None:
    """v = 10 + 3 t^2 / 2 over the first second: a straight line would begin at 9.75 m/s."""
    time = np.linspace(0.0, 4.0, 401)
    noisy = 10.0 + 1.5 * time**2 + np.random.default_rng(3).normal(0.0, 0.02, time.size)
    value, std = end_speed(time, noisy, first=True)
    assert abs(value - 10.0) < std < 0.2
    assert abs(value - 10.0) < 0.03


@pytest.mark.parametrize("jerk", [-0.5, 0.0, 0.3])
def test_a_start_speed_is_not_off_by_a_jerk_too_small_to_be_seen(jerk: float) -> None:
    """All accelerating starts share the error, so its mean over many starts is tested, not the noise of one."""
    time = np.arange(0.0, 4.0, 0.02)
    off = []
    for seed in range(60):
        noisy = 10.0 + time + 0.5 * jerk * time**2 + np.random.default_rng(seed).normal(0.0, 0.03, time.size)
        value, std = end_speed(time, noisy, first=True)
        off.append((value - 10.0) / std)
    assert abs(np.mean(off)) < 0.4
    assert np.std(off) < 1.3


def test_a_car_that_stands_all_through_is_no_drive() -> None:
    still = log(speed=np.zeros(TIME.size), drive_torque=np.zeros(TIME.size), brake_torque=np.zeros(TIME.size))
    found, said = drive_segments([log(), still], [RunConditions("out"), RunConditions("back")], Segmentation("vehicle"))
    assert [s.run for s in found] == [0]
    assert any("no segment of this run can be simulated" in f.what for f in said)


def test_an_output_that_holds_one_value_all_through_is_none(root: Path, tmp_path: Path) -> None:
    """It would be mistaken for noise shared by all outputs, and nothing would be outside its band."""
    found = inputs(root, tmp_path, true_parameters())
    logs = [log.between(0.0, 6.0) for log in found.data]
    stuck = [log.with_channels(wheel_speed_fl=np.full(log.time.size, 3.0)) for log in logs]
    whole, left = (
        ValidateProblem(found.spec, tuple(some), found.known).baseline.sensors.channels for some in (logs, stuck)
    )
    assert set(whole) - set(left) == {"wheel_speed_fl"}
    still = [log.with_channels(speed=np.full(log.time.size, 3.0)) for log in logs]
    assert "speed" in ValidateProblem(found.spec, tuple(still), found.known).baseline.sensors.channels


def test_a_brake_channel_of_noise_alone_brakes_nowhere() -> None:
    noise = 2.0 * np.random.default_rng(4).standard_normal(TIME.size)
    drive = log(brake_torque=noise, drive_torque=RECUPERATED)
    found, _ = drive_segments([drive], [RunConditions()], Segmentation("road_load"))
    assert sum(s.duration for s in found) > 45.0


def test_a_brake_channel_of_noise_clipped_at_zero_brakes_nowhere() -> None:
    """Two thirds of its samples are zero, so that half of them equal the one before."""
    noise = np.maximum(np.round(np.random.default_rng(4).standard_normal(TIME.size)), 0.0)
    drive = log(brake_torque=noise, drive_torque=RECUPERATED)
    found, _ = drive_segments([drive], [RunConditions()], Segmentation("road_load"))
    assert sum(s.duration for s in found) > 45.0


def test_a_brake_that_holds_the_car_at_rest_alone_brakes_nowhere_else() -> None:
    """The holding torque is small, so that the channel's noise is 2 % of it."""
    noise = 2.0 * np.random.default_rng(5).standard_normal(TIME.size)
    hold = np.where(SPEED < 0.1, 90.0, 0.0)
    drive = log(brake_torque=hold + noise, drive_torque=RECUPERATED)
    (s,), _ = drive_segments([drive], [RunConditions()], Segmentation("road_load"))
    assert s.duration > 45.0


def test_a_braked_stretch_is_left_out_whatever_the_noise() -> None:
    noise = 2.0 * np.random.default_rng(6).standard_normal(TIME.size)
    found, _ = drive_segments([log(brake_torque=BRAKE + noise)], [RunConditions()], Segmentation("road_load"))
    assert [(round(s.time[0]), round(s.time[-1])) for s in found] == [(4, 48)]
