"""A result that is not published: report and JSON state why and show where it fails; no later step can use it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import yaml

from tests.bench import cases
from tests.plant.vehicle import random_vehicle
from tests.result_check import validator
from vdyn_cli.commands.run_pipeline import run_pipeline
from vdyn_cli.commands.run_step import print_step, run_step
from vdyn_cli.project.execute import RefusedResultError, execute
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameter_json import read_document

GAIN = -0.05  # of the hub torque: the moment balance then leaves a negative inertia


@pytest.fixture(scope="module")
def gained(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Drives of a wheel whose torque reads 5 % low; gain and radius are collinear; neither may be added."""
    path = cases.wheel_drives(random_vehicle(5), 5, tmp_path_factory.mktemp("gain"), {"hub_torque_gain": GAIN})
    few = "diagnose: {effects: [hub_torque_gain, wheel_radius], extend: never}\n"
    path.write_text(path.read_text(encoding="utf-8") + few, encoding="utf-8")
    return path


@pytest.fixture(scope="module")
def refused(gained: Path) -> tuple[Path, RefusedResultError]:
    """The folder of the step's files, and its error."""
    folder = gained.parent / "out"
    with pytest.raises(RefusedResultError) as caught:
        print_step(run_step("inertia", gained, (), str(folder), 0.05), lambda text, detail=False, result=False: None)
    return folder, caught.value


@pytest.mark.slow
def test_the_effect_makes_the_result_publishable(gained: Path) -> None:
    test = yaml.safe_load(gained.read_text(encoding="utf-8"))
    test["diagnose"] = {"effects": ["hub_torque_gain", "clock_offset"]}
    path = gained.with_name("few.yaml")
    path.write_text(yaml.safe_dump(test, sort_keys=False), encoding="utf-8")
    result = execute("inertia", path).result
    assert result.diagnosis is not None
    assert [c.effect for c in result.diagnosis.causes] == ["hub_torque_gain"]
    assert result.refused == ()
    low, high = result.diagnosis.causes[0].unknowns["hub_torque_gain"].interval95
    assert low < GAIN < high
    assert result.parameters["wheel_inertia"].baseline is None
    assert any("without hub_torque_gain the fit is refused" in f.what for f in result.findings)


def test_a_refused_result_has_no_parameters_and_all_the_rest(refused: tuple[Path, RefusedResultError]) -> None:
    folder, error = refused
    document = json.loads((folder / "inertia.json").read_text(encoding="utf-8"))
    validator("result").validate(document)
    assert document["parameters"] == {}
    assert "negative inertia" in document["refused"][0]["what"]
    assert {"hub_torque_gain", "wheel_radius"} <= set(document["diagnosis"]["ambiguous"][0])
    assert document["sentence"].startswith("No result: ")
    assert document["fit"]["runs"]
    assert error.exit_code == 1
    page = (folder / "inertia.html").read_text(encoding="utf-8")
    assert "no result" in page
    assert "<svg" in page
    assert "negative inertia" in page


@pytest.mark.slow  # the diagnosis of the test above once more
def test_a_pipeline_shows_the_refused_step(gained: Path) -> None:
    day = gained.with_name("day.yaml")
    day.write_text("pipeline: a day\nsteps: [inertia.yaml]\n", encoding="utf-8")
    folder = gained.parent / "day"
    assert run_pipeline(day, folder, keep_going=True, jobs=1, tell=lambda text, detail=False: None) == 1
    document = json.loads((folder / "parameters.json").read_text(encoding="utf-8"))
    assert "wheel_inertia" not in document["parameters"]
    assert not document["steps"]["inertia"]["good"]
    assert document["steps"]["inertia"]["verdict"] == "ambiguous"
    page = (folder / "report.html").read_text(encoding="utf-8")
    assert 'id="step-inertia"' in page
    assert "<svg" in page


def test_no_step_reads_a_refused_result(refused: tuple[Path, RefusedResultError]) -> None:
    with pytest.raises(InputError, match=r"contains no parameters: the result of 'inertia' was not published"):
        read_document(refused[0] / "inertia.json")
