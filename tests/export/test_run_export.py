"""Messages of the export command about wrong input; it writes all files or none."""

from __future__ import annotations

import json
import subprocess
import sys
import zipfile
from pathlib import Path
from xml.etree import ElementTree as Xml

import pytest

from tests.engine.c_host import build
from tests.export.cases import CAR, document, written
from vdyn_cli.commands.run_export import run_export
from vdyn_cli.export import FORMATS
from vdyn_cli.quantities.errors import InputError


def refused(path: Path, form: str = "c", name: str = "vehicle", driven: str = "front") -> str:
    """The message; nothing may be left behind."""
    folder = path.parent / "made"
    with pytest.raises(InputError) as error:
        run_export(path, form, folder, name, driven, tell=lambda text, detail=False: None)
    assert error.value.exit_code == 2
    assert not folder.exists()
    return str(error.value)


@pytest.mark.parametrize("form", FORMATS)
def test_every_format_writes_its_files_and_says_which(tmp_path, form):
    said: list[str] = []
    folder = tmp_path / "made"
    run_export(written(tmp_path), form, folder, "car", "rear", tell=lambda text, detail=False: said.append(text))
    files = sorted(path.name for path in folder.iterdir())
    assert files
    assert {str(folder / name) for name in files} <= set(said)
    assert all(name.startswith("car") for name in files)


def test_a_misspelled_parameter_is_reported_with_the_one_that_is_needed(tmp_path):
    path = written(tmp_path)
    path.write_text(path.read_text(encoding="utf-8").replace("tire_vertical_stiffness", "tire_virtical_stiffness"))
    text = refused(path, "tir")
    assert text.startswith("parameters.json, parameters.tire_virtical_stiffness: no such parameter")
    assert "-> rename it to tire_vertical_stiffness" in text
    assert "vdyn bump" not in text


def test_missing_parameters_are_reported_at_once_with_the_step_that_gives_them(tmp_path):
    without = ("mass", "tire_B", "tire_C", "cg_height", "shaft_stiffness_left")
    text = refused(written(tmp_path, without=without))
    assert "the full vehicle needs mass, not given" in text
    assert "needs tire_B, tire_C, which 'vdyn tire' estimates" in text
    assert "add to the test 'tire' what determines tire_B, tire_C (it gave" in text
    assert "add the test 'cg' to the pipeline" not in text
    assert "cg_height, which 'vdyn cg' estimates" in text
    assert "shaft_stiffness_left" in text
    assert "roll_inertia" not in text  # follows from the mass
    text = refused(written(tmp_path, without=("road_load_f1", "tire_D", "tire_vertical_stiffness")), "abc")
    assert text.startswith("parameters.json: a dynamometer needs road_load_f1, which 'vdyn coastdown' estimates")
    assert "tire" not in text
    text = refused(written(tmp_path, without=("tire_D", "tire_vertical_stiffness", "gear_ratio")), "tir")
    assert "'vdyn tire'" in text
    assert "'vdyn bump'" in text
    assert "gear_ratio" not in text


@pytest.mark.parametrize(
    ("change", "form", "message"),
    [
        ({}, "tri", "did you mean tir?"),
        ({}, "xlsx", "there are c, fmu, tir, abc, fastsim, wltp, mat"),
        ({"name": "2cv"}, "c", "--name"),
        ({"name": "a/../b"}, "mat", "--name"),
        ({"driven": "left"}, "c", "write front or rear or both"),
    ],
)
def test_a_wrong_option(tmp_path, change, form, message):
    assert message in refused(written(tmp_path), form, **change)


def test_what_is_no_parameter_file(tmp_path):
    path = tmp_path / "x.json"
    assert "does not exist" in refused(path)
    for text, message in (("mass: 1", "is not JSON"), ("[1]", "not a parameter file"), ("{}", "has no key 'format'")):
        path.write_text(text, encoding="utf-8")
        assert message in refused(path)


def test_values_that_no_vehicle_has(tmp_path):
    path = tmp_path / "x.json"
    wrong = document()
    wrong["parameters"]["mass"]["value"] = 1.4
    wrong["parameters"]["wheel_radius"]["value"] = 297.0
    path.write_text(json.dumps(wrong), encoding="utf-8")
    text = refused(path)
    assert "parameter 'mass': lies outside 50 to 1e+06 kg (got 1.4)" in text
    assert "wheel_radius" in text
    wrong = document()
    wrong["parameters"]["mass"]["value"] = None
    path.write_text(json.dumps(wrong), encoding="utf-8")
    assert "parameter 'mass'" in refused(path)


def test_an_effect_without_its_numbers(tmp_path):
    text = refused(written(tmp_path, causes=[{"effect": "brake_drag"}]))
    assert "an effect lacks its name or the values of its unknowns" in text


def test_a_parameter_file_without_a_diagnosis_is_one(tmp_path):
    plain = document()
    del plain["diagnosis"], plain["title"]
    path = tmp_path / "x.json"
    path.write_text(json.dumps(plain), encoding="utf-8")
    run_export(path, "tir", tmp_path / "made", "car", "front", tell=lambda text, detail=False: None)
    assert len(plain["parameters"]) == len(CAR)


def test_the_command_line(tmp_path):
    path = written(tmp_path)

    def vdyn(*arguments: str) -> subprocess.CompletedProcess[str]:
        start = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
        return subprocess.run(
            [sys.executable, "-c", start, "export", *arguments], capture_output=True, text=True, check=False
        )

    done = vdyn(str(path), "--to", "abc", "-o", str(tmp_path / "made"), "--name", "car")
    assert (done.returncode, done.stdout) == (0, "")
    assert "car_road_load.csv" in done.stderr
    assert (tmp_path / "made" / "car_road_load.csv").exists()
    wrong = vdyn(str(path), "--to", "tri")
    assert wrong.returncode == 2
    assert wrong.stderr == "--to: is not a format of vdyn export (got 'tri')\n    -> did you mean tir?\n"
    assert vdyn(str(path)).returncode == 2


def test_a_title_can_not_break_what_it_stands_in(tmp_path):
    odd = {**document(), "title": 'a */ b /* c & <d> "e"\n\\\u0007 f'}
    path = tmp_path / "x.json"
    path.write_text(json.dumps(odd), encoding="utf-8")
    for form in ("c", "fmu", "tir"):
        run_export(path, form, tmp_path, "car", "front", tell=lambda text, detail=False: None)
    build(tmp_path, ["car.c", "car_main.c"], "car")
    with zipfile.ZipFile(tmp_path / "car.fmu") as archive:
        described = Xml.fromstring(archive.read("modelDescription.xml")).get("description")
    assert described == 'a */ b /* c & <d> "e" \\  f (x.json)'
