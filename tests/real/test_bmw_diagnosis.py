"""What the program finds on an electric car's trips: hills, loss, the accelerometer's zero, cold against warm."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.bench.bmw_diagnosis import diagnosed, repeats
from vdyn_cli.quantities.result import Result

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


@pytest.fixture(scope="module")
def result(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Result:
    folder = shared_data / "bmw_i3"
    if not folder.is_dir():
        pytest.skip(f"the trips are not at {folder}")
    return diagnosed("all", folder, tmp_path_factory.mktemp("bmw"))


def test_hills_are_found_and_a_loss_or_what_looks_like_it(result: Result) -> None:
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"
    assert ("accelerometer_slope",) in told.ambiguous
    (losses,) = [set(one) for one in told.ambiguous if "driveline_loss" in one]
    assert {"mass_error", "torque_gain"} <= losses
    found = result.amplitudes
    assert 0.8 < found["accelerometer_slope"].value < 1.1
    assert found["driveline_loss"].interval95[0] > 0.02
    assert found["driveline_loss"].interval95[1] < 0.25


def test_the_same_hills_are_found_on_other_days_and_backwards(result: Result) -> None:
    found = repeats(result.extra["validation"]["road"])
    assert len(found) == 8
    assert min(r for _, _, r in found) > 0.9


def test_the_accelerometer_has_next_to_no_zero(result: Result) -> None:
    zero = result.extra["validation"]["road"]["accelerometer_zero"]
    assert abs(zero["value"]) < 0.04
    assert zero["interval95"][1] - zero["interval95"][0] < 0.06


def test_winter_resists_more_than_summer(result: Result) -> None:
    road = result.extra["validation"]["road"]
    assert road["seasons"]["cold"]["temperature_degC"] < 6 < 18 < road["seasons"]["warm"]["temperature_degC"]
    more = road["seasons"]["more"]
    assert 20 < more["value"] < 120
    assert more["value"] / more["std"] > 1.5, "four winter trips tell it, but not beyond doubt"
    held = [f["value"] for f in road["holding_force"]]
    assert np.all(np.diff(held) > 0)


def test_trips_that_were_left_out_are_predicted_better(result: Result) -> None:
    held = result.extra["validation"]["road"]["held_out"]
    assert held["rms_after"] < 0.6 * held["rms_before"]
    assert held["gain"]["interval95"][0] > 0.3
    assert held["mean_before"]["interval95"][0] > 0
    low, high = held["mean_after"]["interval95"]
    assert low < 0 < high
