"""Strict descriptions: all errors are reported together, with file, line and remedy."""

from __future__ import annotations

from pathlib import Path

import pytest

from vdyn_cli.description.description_model import Description
from vdyn_cli.description.spec_loading import load_partial, load_spec
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps import load_step

GOOD = """test: coastdown
vehicle: vehicle.yaml
environment: {temperature: 24 degC, pressure: 98.9 kPa}
channels:
  time: {column: Time, unit: s}
runs:
  - {log: a.csv, direction: out, start: 0 s}
"""


def load(folder: Path, text: str, vehicle: str = "mass: 1588 +- 5 kg\n") -> Description:
    (folder / "vehicle.yaml").write_text(vehicle)
    (folder / "test.yaml").write_text(text)
    return load_spec(folder / "test.yaml", Description)[0]


def test_quantities_are_si_and_the_vehicle_may_stand_in_its_own_file(tmp_path: Path) -> None:
    spec = load(tmp_path, GOOD)
    assert dict(spec.vehicle.items()) == {"mass": Given(1588.0, 5.0)}
    assert spec.environment.pressure == Given(98_900.0)
    assert spec.runs[0].direction == "out"


@pytest.mark.parametrize(
    ("line", "remedy"),
    [
        ("environment: {mass: 1500 kg}", "move it to 'vehicle'"),
        ("vehicle: {temperature: 20 degC}", "move it to 'environment'"),
        ("environment: {direction: out}", "move it to every run"),
        ("diagnose: {title: today}", "move it to the top level"),
        ("vehicle: {mass: 1 t}\nenvironment: {mass: 3}", "remove it: 'vehicle' has it already, at test.yaml:5"),
        ("runs2: []", "'runs' is stated at test.yaml:3: move the entries there"),
        ("runs: [{log: a.csv, speed: x}]", "speed is a channel: write it in braces, as in 'units: {speed: km/h}'"),
    ],
)
def test_a_key_in_the_wrong_place_is_sent_to_its_own(tmp_path: Path, line: str, remedy: str) -> None:
    text = "test: coastdown\nchannels: {time: {column: T, unit: s}}\n"
    text += "" if line.startswith("runs:") else "runs:\n  - {log: a.csv}\n"
    with pytest.raises(InputError, match=f"unknown key .*\n.*{remedy}"):
        load(tmp_path, f"{text}{line}\n")


def test_everything_wrong_is_said_at_once(tmp_path: Path) -> None:
    text = """test: coastdown
vehicle: vehicle.yaml
enviroment: {temperature: 24 degC}
channels:
  time: {column: T, unit: s, sing: -1}
runs:
  - {log: a.csv, direction: sideways, start: 3 kg}
  - {direction: out}
"""
    vehicle = "mass: heavy\nwheelbas: 2.7 m\nfrontal_area: 2.19 kg\nwheel_radius: 308 m\n"
    with pytest.raises(InputError) as caught:
        load(tmp_path, text, vehicle)
    said = str(caught.value)
    for part in (
        "test.yaml:3: unknown key 'enviroment'",
        "did you mean environment",
        "test.yaml:5: unknown key 'sing'",
        "did you mean sign",
        "test.yaml:7: 'runs.0.direction'",
        "test.yaml:7: 'runs.0.start' 'kg' is not a unit of time (s)",
        "test.yaml:8: 'runs.1': a run has either 'log' or 'logs'",
        "vehicle.yaml:1: 'vehicle.mass' 'heavy' is not a number with a unit",
        "vehicle.yaml:2: unknown key 'wheelbas'",
        "vehicle.yaml:3: 'vehicle.frontal_area' 'kg' is not a unit of area (m^2)",
        "vehicle.yaml:4: 'vehicle.wheel_radius' is outside the physical range",
    ):
        assert part in said, f"{part!r} not in\n{said}"


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("", "is empty"),
        ("- 1\n- 2\n", "must be a mapping"),
        ("just words\n", "must be a mapping"),
        ("test: [1]\n", "'test'"),
        ("test: coastdown\nvehicle: nowhere.yaml\n", "test.yaml:2: .*nowhere.yaml does not exist"),
        ("test: coastdown\nvehicle: [1, 2]\n", "vehicle"),
        ("test: coastdown\nruns: {log: a.csv}\n", "runs"),
        ("test: coastdown\nvehicle: {mass: true}\n", "not a number with a unit"),
        ("test: coastdown\nvehicle: {mass: .nan}\n", "is not a finite number"),
        ("test: coastdown\nvehicle: {mass: .inf}\n", "is not a finite number"),
        ("test: coastdown\nreading: {decimal: ';'}\n", "decimal"),
        ("test: coastdown\ndiagnose:\n", "test.yaml:2: 'diagnose' must be a mapping of keys to values"),
        ("test: coastdown\ndiagnose: {effects: headwind}\n", r"takes all, none, or a list such as \[headwind\]"),
        ("test: coastdown\ndiagnose: {extend: headwind}\n", r"takes never, named, learned, or a list such"),
        (
            "test: coastdown\ndiagnose: {effects: [headwind, 3]}\n",
            r"^test.yaml:2: 'diagnose.effects.1' must be a text [^\n]*$",
        ),
        ("test: coastdown\nruns: [{log: [a.csv, b.csv]}]\n", "'runs.0.log' must be a text .*\n    -> .*'logs: "),
        ("test: coastdown\nruns: [{log: a.csv, units: [{}, {}]}]\n", "'units' is a list only with 'logs'"),
        (
            "test: coastdown\nalign_on: [speed]\n",
            r"'align_on' needs at least 2 entries \(got \['speed'\]\)\n    -> add the missing ones",
        ),
        (
            "test: coastdown\nchannels: {speed: {column: v, unit: 3.6}}\n",
            "must be a text .*\n    -> write the name of the",
        ),
        ("test: coastdown\nruns: [{log: a.csv, units: km/h}]\n", "in braces, such as 'units: {speed: km/h}'"),
        ("test: coastdown\nvehicle: {frontal_area: 2.19 +- 30 m^2}\n", "larger than the value"),
        ("test: coastdown\nruns: [{log: a.csv, direction: [out]}]\n", "must be 'out' or 'back'"),
        ("test: coastdown\ndiagnose: {effects: []}\n", "test.yaml:2: .*Write all, none, or a list"),
        ("test: coastdown\ndiagnose: {extend: []}\n", "Write never, named, learned, or a list"),
        ("test: coastdown\ndiagnose: {effects: none, extend: [headwind]}\n", "requests effects, but 'effects' is none"),
    ],
)
def test_refusals(tmp_path: Path, text: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        load(tmp_path, text)


@pytest.mark.parametrize(
    ("name", "content", "says"),
    [
        ("test.yaml", b"test: coastdown\nruns:\n\t- {log: a.csv}\n", "test.yaml:3: .*\n    -> indent with blanks"),
        ("run.csv", b"t;v\n0,1;2,3\n", "run.csv: is not a description of a test.*\n    -> .*'vdyn init STEP LOG"),
        ("run.CSV", "t;H\u00f6he\n0;1\n".encode("latin-1"), "run.CSV: is not a description of a test"),
        (
            "c.json",
            b'{"format": "vdyn/parameters/1", "step": "cg"}',
            "^[^\n]*c.json: is a result of vdyn cg, not a[^\n]*\n.*--known",
        ),
        ("test.yaml", b"test: coastdown\nruns:\n  - a.csv\n", "-> write '{log: a.csv}'"),
        (
            "test.yaml",
            b"test: coastdown\nvehicle: {mass: 3 sqm}\n",
            "not a unit .*\n    -> write a number with its unit, .*1 kg",
        ),
        ("test.yaml", b"test: coastdown\nenvironment: {pressure: 98.9}\n", "a plain number is in Pa: write '98.9 kPa'"),
        ("test.yaml", b"test: coastdown\nenvironment: {pressure: 989}\n", "a plain number is in Pa: write '989 hPa'"),
        ("test.yaml", b"test: coastdown\nenvironment: {pressure: 5}\n", r"40000 to 110000 Pa\) \(got 5\)"),
        ("test.yaml", b"test: coastdown\nreading: {clock: sort}\n", "-> write 'strict' or 'drop'"),
    ],
)
def test_what_a_stranger_writes_has_a_remedy(name: str, content: bytes, says: str, tmp_path: Path) -> None:
    (tmp_path / name).write_bytes(content)
    with pytest.raises(InputError, match=says):
        load_spec(tmp_path / name, Description)


def test_a_folder_is_answered_with_its_descriptions(tmp_path: Path) -> None:
    (tmp_path / "coast.yaml").write_text(GOOD)
    with pytest.raises(InputError, match=r"is a folder\n    -> name a description in it, such as '.*coast.yaml'"):
        load_spec(tmp_path, Description)


def test_a_wrong_value_is_not_also_reported_as_missing(tmp_path: Path) -> None:
    (tmp_path / "test.yaml").write_text("test: bump\nbump: {height: 0.06 mm, width: 500 mm}\n")
    (said,) = load_partial(tmp_path / "test.yaml", load_step("bump").spec).problems
    assert said.what.startswith("'bump.height' is outside the physical range")


def test_a_misspelled_key_is_not_also_reported_as_missing(tmp_path: Path) -> None:
    (tmp_path / "test.yaml").write_text("test: bump\nbump: {heigth: 60 mm, width: 500 mm, shape: haversine}\n")
    (said,) = load_partial(tmp_path / "test.yaml", load_step("bump").spec).problems
    assert (said.what, said.remedy) == ("unknown key 'heigth'", "did you mean height?")


@pytest.mark.parametrize(
    ("lines", "says"),
    [
        ("runs: {log: a.csv}", "'runs' must be a list"),
        ("settings: {speed_window: [20 km/h, 20 km/h]}", "the highest and the lowest speed are the same"),
    ],
)
def test_a_wrong_list_is_named_with_what_to_write(lines: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "test.yaml").write_text(f"test: coastdown\n{lines}\n")
    problems = load_partial(tmp_path / "test.yaml", load_step("coastdown").spec).problems
    (said,) = (p for p in problems if says in p.what)
    assert "write" in said.remedy + said.what


def test_a_test_in_place_of_a_vehicle_is_one_problem(tmp_path: Path) -> None:
    (tmp_path / "other.yaml").write_text("test: tire\nchannels: {}\nruns: []\n")
    (tmp_path / "test.yaml").write_text("test: coastdown\nvehicle: other.yaml\n")
    with pytest.raises(InputError, match=r"^test.yaml:2: other.yaml describes a test, not a vehicle\n    -> [^\n]*$"):
        load_spec(tmp_path / "test.yaml", Description)
