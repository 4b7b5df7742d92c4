"""One trip of an electric car over unlogged hills, described by someone who states the certified road load only."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml

from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.result import Result

pytestmark = pytest.mark.slow  # diagnoses of 4 to 9 s

DESCRIPTION = {
    "test": "validate",
    "vehicle": {
        "mass": "1417 +- 80 kg",
        "gear_ratio": 9.7,
        "wheel_radius": "340.5 mm",
        "driveline_efficiency": 1,
        "road_load_f0": "101.9 N",
        "road_load_f1": "3.443 N/(m/s)",
        "road_load_f2": "0.3619 N/(m/s)^2",
        "rotating_mass": "60 kg",
    },
    "environment": {"temperature": "20 degC", "pressure": "95.3 kPa"},
    "channels": {
        "time": {"column": "Time [s]", "unit": "s"},
        "speed": {"column": "Velocity [km/h]", "unit": "km/h"},
        "drive_torque": {"column": "Motor Torque [Nm]", "unit": "N m"},
        "acceleration": {"column": "Longitudinal Acceleration [m/s^2]", "unit": "m/s^2"},
    },
}


def validated(trip: str, shared_data: Path, folder: Path, **settings: Any) -> Result:
    log = shared_data / "bmw_i3" / f"{trip}.csv.gz"
    if not log.is_file():
        pytest.skip(f"the trip is not at {log}")
    path = folder / "validate.yaml"
    described = {**DESCRIPTION, "settings": {"model": "road_load", **settings}, "runs": [{"log": str(log)}]}
    path.write_text(yaml.safe_dump(described), encoding="utf-8")
    return execute("validate", path).result


@pytest.mark.thorough  # 12 s
def test_hills_beside_a_loss_that_outweighs_them_are_named(shared_data: Path, tmp_path: Path) -> None:
    """The hills alone hardly lower the error: on the road shown the simulation is still too fast, by the loss."""
    told = validated("TripA01", shared_data, tmp_path).diagnosis
    assert told is not None
    assert told.verdict == "named"
    assert told.extended == ("accelerometer_slope", "driveline_loss")


@pytest.mark.thorough
def test_one_of_several_answers_is_published_where_the_baseline_misses_the_trip(
    shared_data: Path, tmp_path: Path
) -> None:
    """The simulation is off by 34 % of the largest speed, with hills, a loss and any of four drags by 4 km/h."""
    result = validated("TripA14", shared_data, tmp_path)
    told = result.diagnosis
    assert told is not None
    assert told.verdict == "ambiguous"
    assert ("accelerometer_slope",) in told.ambiguous
    assert "one of 4 answers" in result.sentence
    assert 3.6 * result.fit.rms < 8.0
    assert any("3 other answers" in f.what for f in result.findings)


@pytest.mark.thorough
def test_windows_answer_for_a_long_trip_that_is_missed_as_a_whole(shared_data: Path, tmp_path: Path) -> None:
    """Over 20 s windows, hills are named in one trip alone; the result states that it holds for windows only."""
    result = validated("TripA11", shared_data, tmp_path)
    assert result.diagnosis is not None
    assert result.diagnosis.extended == ("accelerometer_slope",)
    assert "This holds for windows with drive torque only" in result.sentence
    assert any("no result for the whole drive" in w for w in result.fit.warnings)
