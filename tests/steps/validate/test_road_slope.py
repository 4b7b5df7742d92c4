"""The road from an accelerometer, on drives with a known road."""

from __future__ import annotations

import numpy as np
import pytest

from tests.open_road import G, Made, Truth, drive
from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.road.road_slope import sensed_road, sensed_roads


def log_of(made: Made, **more: np.ndarray) -> Log:
    return Log("drive", made.time, {"speed": made.speed, "acceleration": made.felt, **more})


def test_hills_are_found_without_the_torque() -> None:
    for seed in range(3):
        made = drive(Truth(zero=0.0), seed)
        found = sensed_road(log_of(made))
        assert np.corrcoef(found.slope, made.slope)[0, 1] > 0.97
        assert np.std(found.slope - made.slope) < 0.003


def test_the_zero_makes_the_drive_level_from_end_to_end() -> None:
    made = drive(Truth(zero=0.3), 4)
    level, tilted = sensed_road(log_of(drive(Truth(zero=0.0), 4))), sensed_road(log_of(made))
    assert abs(tilted.zero - level.zero - 0.3) < 0.002
    assert np.allclose(tilted.slope, level.slope, atol=2e-4)
    assert abs(float(np.mean(tilted.profile))) < 1e-3


def test_a_grade_that_is_known_is_left_out() -> None:
    made = drive(Truth(), 5)
    rest = sensed_road(log_of(made, grade=made.slope))
    assert np.std(rest.slope) < 0.2 * np.std(made.slope)


def test_gaps_and_stops_do_no_harm() -> None:
    made = drive(Truth(), 6)
    speed, force = made.speed.copy(), made.felt.copy()
    force[500:520] = np.nan
    speed[1000:1100] = np.linspace(speed[1000], 0.0, 100)
    force[1000:1100] = np.gradient(speed[1000:1100], made.time[1000:1100]) + G * made.slope[1000:1100]
    speed[1100:], force[1100:] = 0.0, 0.5  # it stands, and a brake rocks it
    found = sensed_road(Log("drive", made.time, {"speed": speed, "acceleration": force}))
    assert np.corrcoef(found.slope[:1000], made.slope[:1000])[0, 1] > 0.97
    assert np.ptp(found.slope[1120:]) < 1e-3, "a car that stands tells nothing of its road"


def test_the_heights_at_both_ends_give_the_zero_on_a_road_that_climbs() -> None:
    """1 % over 3 km: if the ends were taken as level, the accelerometer's zero would absorb all of it."""
    made = drive(Truth(zero=0.0, hills=0.0), 7, seconds=150.0)
    climb = np.r_[0.0, np.cumsum(np.diff(made.time) * made.speed[1:])] * 0.01
    felt = made.felt + G * 0.01
    log = Log("drive", made.time, {"speed": made.speed, "acceleration": felt, "elevation": climb})
    assert abs(sensed_road(log).zero) < 0.02
    assert abs(np.mean(sensed_road(log).slope) - 0.01) < 0.002


def test_logs_take_the_slopes_of_their_roads_as_channels() -> None:
    logs = [log_of(drive(Truth(), 7, seconds=60.0)), log_of(drive(Truth(), 8, seconds=60.0))]
    roads = sensed_roads(logs)
    assert roads.inputs == ("accelerometer_slope",)
    for log, road in zip(roads.channels(logs), roads.sensed, strict=True):
        assert np.array_equal(log["accelerometer_slope"], road.slope)


def test_drives_out_and_back_on_a_hill_share_one_zero() -> None:
    """1 % up and down again: zeros that differ by 0.2 m/s^2 are hills, as one accelerometer does not scatter so."""
    out, back = (drive(Truth(zero=0.1, hills=0.0), seed, seconds=150.0) for seed in (11, 11))
    felt = [one.felt + G * climb for one, climb in ((out, 0.01), (back, -0.01))]
    logs = [Log("drive", m.time, {"speed": m.speed, "acceleration": f}) for m, f in zip((out, back), felt, strict=True)]
    slopes = sensed_roads(logs, scatter=0.02).slopes
    level = sensed_roads(logs).slopes
    assert [abs(np.mean(s)) < 0.001 for s in level] == [True, True]
    assert np.mean(slopes[0]) - np.mean(slopes[1]) == pytest.approx(0.02, abs=0.002)
