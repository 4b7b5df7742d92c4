"""All problems of a description and its logs are reported at once, as are keys that a step does not read."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step

GOOD: dict[str, Any] = {
    "test": "coastdown",
    "vehicle": {"mass": "1500 kg", "air_density": 1.2},
    "channels": {"time": {"column": "t", "unit": "s"}, "speed": {"column": "v", "unit": "m/s"}},
    "runs": [{"log": "a.csv", "direction": "out"}],
}


def read(folder: Path, step: str = "coastdown", **changed: Any) -> Inputs:
    time = np.arange(0.0, 20.0, 0.1)
    np.savetxt(folder / "a.csv", np.column_stack([time, 25 - 0.5 * time]), delimiter=",", header="t,v", comments="")
    description = {n: v for n, v in {**GOOD, **changed}.items() if v is not None}
    (folder / "test.yaml").write_text(yaml.safe_dump(description, sort_keys=False))
    return gather(load_step(step), folder / "test.yaml")


def problems(folder: Path, **changed: Any) -> str:
    with pytest.raises(InputError) as error:
        read(folder, **changed)
    return str(error.value)


def test_wrong_keys_missing_logs_units_columns_and_numbers_come_in_one_round(tmp_path: Path) -> None:
    text = problems(
        tmp_path,
        titel="x",
        vehicle={"air_density": 1.2},
        channels={
            "time": {"column": "t", "unit": "s"},
            "speed": {"column": "w", "unit": "kmx"},
            "foo": {"constant": 1},
        },
        runs=[{"log": "a.csv", "direction": "outt"}, {"log": "b.csv"}],
        settings={"terms": 7, "minimum_length": "10 kg"},
    )
    for said in (
        "unknown key 'titel'",
        "'runs.0.direction'",
        "'settings.terms'",
        "'settings.minimum_length' 'kg' is not a unit of time (s)",
        "unknown channel 'foo'",
        "'kmx' is not a unit",
        "no such column in a.csv (got 'w')",
        "the log b.csv does not exist",
    ):
        assert said in text, said


def test_what_init_left_open_is_reported_once_a_line_in_their_order(tmp_path: Path) -> None:
    channels = {"time": {"column": "t", "unit": "s"}, "speed": {"column": "?", "unit": "?"}}
    text = problems(tmp_path, channels=channels, vehicle={"mass": "?", "air_density": 1.2})
    marked = [line for line in text.splitlines() if '"?"' in line and "->" not in line]
    assert [line.split("'")[1] for line in marked] == ["vehicle.mass", "channels.speed"]
    assert "is not a unit" not in text
    assert "no such column" not in text


def test_missing_channels_name_the_manoeuvre_that_does_not_need_them(tmp_path: Path) -> None:
    columns = {"time": "s", "hub_torque": "N m", "wheel_speed": "rad/s"}
    channels = {n: {"column": n, "unit": unit} for n, unit in columns.items()}
    (tmp_path / "wheel.yaml").write_text(
        yaml.safe_dump({"test": "inertia", "channels": channels, "runs": [{"log": "wheel.csv"}]})
    )
    with pytest.raises(InputError) as error:
        gather(load_step("inertia"), tmp_path / "wheel.yaml")
    assert "channel hub_force_x is needed" in str(error.value)
    assert "or write 'manoeuvre: stand'" in str(error.value)


def test_a_missing_number_of_the_vehicle_comes_in_the_same_round(tmp_path: Path) -> None:
    text = problems(tmp_path, titel="x", vehicle={"air_density": 1.2})
    assert "unknown key 'titel'" in text
    assert "mass (vehicle mass as tested) is needed" in text


def test_a_missing_number_is_reported_at_the_vehicle_of_the_description(tmp_path: Path) -> None:
    """Alone and together with other problems, with the line of the description instead of the step's name."""
    assert re.search(
        r"^test\.yaml:\d+: mass \(", problems(tmp_path, titel="x", vehicle={"air_density": 1.2}), re.MULTILINE
    )
    read(tmp_path, vehicle={"air_density": 1.2})
    with pytest.raises(InputError, match=r"^test\.yaml:\d+: mass \("):
        execute("coastdown", tmp_path / "test.yaml")
    (tmp_path / "car.yaml").write_text("# a car\nair_density: 1.2\n")
    read(tmp_path, vehicle="car.yaml")
    with pytest.raises(InputError, match=r"^car\.yaml:2: mass \("):
        execute("coastdown", tmp_path / "test.yaml")


def test_a_misspelled_channel_is_not_reported_as_missing_too(tmp_path: Path) -> None:
    channels = {"time": {"column": "t", "unit": "s"}, "speed": {"column": "v", "unti": "m/s"}}
    text = problems(tmp_path, channels=channels)
    assert "unknown key 'unti'" in text
    assert "channel speed is needed" not in text


def test_missing_logs_are_reported_beside_a_run_that_names_none(tmp_path: Path) -> None:
    text = problems(tmp_path, runs=[{"log": "b.csv"}, {"direction": "out"}])
    assert "a run has either 'log' or 'logs'" in text


def test_a_description_without_its_main_key_still_tells_of_missing_logs(tmp_path: Path) -> None:
    text = problems(tmp_path, test=None, runs=[{"log": "b.csv"}])
    assert "'test' is missing" in text
    assert "b.csv does not exist" in text


@pytest.mark.parametrize(
    ("changed", "said", "remedy"),
    [
        ({"vehicle": {"mass": 1500, "air_density": 1.2, "tire_C": "1.3 +- 0.1"}}, "by tire", "remove it"),
        ({"vehicle": {"mass": 1500, "air_density": 1.2, "drag_area": 0.6}}, "estimates it", "settings: {fix: {drag_ar"),
        ({"vehicle": {"mass": 1500, "air_density": 1.2, "cg_height": 0.6}}, "'coastdown'", "remove it"),
    ],
)
def test_a_number_that_the_step_does_not_read_is_named(
    tmp_path: Path, changed: dict[str, Any], said: str, remedy: str
) -> None:
    (found,) = [f for f in read(tmp_path, **changed).findings if "'vehicle." in f.what]
    assert said in found.what
    assert remedy in found.remedy
    assert found.where.startswith("test.yaml:")


def test_a_vehicle_file_may_hold_the_numbers_of_all_steps(tmp_path: Path) -> None:
    (tmp_path / "car.yaml").write_text("mass: 1500\nair_density: 1.2\ntire_C: 1.3\n")
    assert not [f for f in read(tmp_path, vehicle="car.yaml").findings if "'vehicle." in f.what]


def test_keys_of_runs_and_air_that_a_step_does_not_read_are_named(tmp_path: Path) -> None:
    channels = {"time": {"column": "t", "unit": "s"}, "slip": {"column": "v", "unit": "1"}, "force_x": {"constant": 1},
                "force_z": {"constant": 1}}  # fmt: skip
    found = read(tmp_path, "tire", test="tire", vehicle=None, channels=channels, environment={"temperature": 293})
    assert {f.what for f in found.findings} == {
        "'environment' is not read by 'tire'",
        "'runs.direction' is not read by 'tire'",
    }


def test_channels_beside_loggers_would_not_be_read_and_are_refused(tmp_path: Path) -> None:
    loggers = [{"channels": GOOD["channels"]}]
    text = problems(tmp_path, loggers=loggers)
    assert "'channels' is not read if there are 'loggers'" in text
    assert "'align_on' needs 'loggers'" in problems(tmp_path, align_on="speed")


def test_files_that_are_no_logs_are_named_as_in_the_description(tmp_path: Path) -> None:
    (tmp_path / "day").mkdir()
    (tmp_path / "day" / "a.csv").write_text("time,speed\n0,1\n1,1\n")
    (tmp_path / "empty.csv").touch()
    text = problems(tmp_path, runs=[{"log": "day"}, {"log": "empty.csv"}])
    assert "test.yaml:13: the log day is a folder, not a log\n    -> name the logs in it, such as day/a.csv" in text
    assert "\nempty.csv: the file is empty" in text


def test_the_missing_half_of_an_axle_is_requested(tmp_path: Path) -> None:
    channels = {n: {"column": n, "unit": u} for n, u in (("time", "s"), ("front_right_load", "N"))}
    (tmp_path / "cg.yaml").write_text(yaml.safe_dump({"test": "cg", "channels": channels, "runs": [{"log": "a.csv"}]}))
    with pytest.raises(InputError, match="add 'front_left_load: "):
        gather(load_step("cg"), tmp_path / "cg.yaml")


def test_a_column_that_no_readable_run_has_is_wrong_in_the_description(tmp_path: Path) -> None:
    channels = {"time": {"column": "t", "unit": "s"}, "speed": {"column": "w", "unit": "m/s"}}
    text = problems(tmp_path, channels=channels, runs=[{"log": "b.csv"}, {"log": "a.csv"}])
    assert "no such column in a.csv (got 'w')\n    -> its columns are" in text
