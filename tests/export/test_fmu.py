"""The exported FMU is valid, contains its source, and gives the results of the Python model."""

from __future__ import annotations

import io
import json
import zipfile
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree as Xml

import numpy as np
import pytest

from tests.engine.c_host import build, compiler
from tests.export.cases import BRAKE_DRAG, LEARNED, LEARNED_LAW, LEARNED_SIZES, given, simulated, stop_and_go
from vdyn_cli.export import ExportOptions, fmu, make
from vdyn_cli.export.exported_vehicle import exported_vehicle
from vdyn_cli.export.fmu_description import exponents

fmpy = pytest.importorskip("fmpy")
validation = pytest.importorskip("fmpy.validation")


def unit(folder: Path, **changes) -> Path:
    """The unit in a file."""
    path = folder / "car.fmu"
    path.write_bytes(made(json.dumps(changes)))
    return path


@cache
def made(changes: str) -> bytes:
    """The unit of the changed parameters (JSON), compiled once for all tests."""
    with TemporaryDirectory() as folder:
        return make(given(Path(folder), **json.loads(changes)), "fmu", ExportOptions("car")).files["car.fmu"]


def runnable(folder: Path, **changes) -> Path:
    """A unit that has a library for this platform; else the test is skipped."""
    compiler()
    path = unit(folder, **changes)
    if fmpy.platform not in fmpy.supported_platforms(str(path)):
        pytest.skip(f"FMI 2.0 has no name for this platform, or no library was made for {fmpy.platform}")
    return path


def slave_of(path: Path, folder: Path) -> tuple[Any, dict[str, int]]:
    """The unit, instantiated, and the references of its variables."""
    unpacked = fmpy.extract(str(path), str(folder / "unpacked"))
    about = fmpy.read_model_description(unpacked)
    slave = fmpy.fmi2.FMU2Slave(
        guid=about.guid, unzipDirectory=unpacked, modelIdentifier=about.coSimulation.modelIdentifier
    )
    slave.instantiate()
    slave.setupExperiment(startTime=0.0)
    slave.enterInitializationMode()
    return slave, {v.name: v.valueReference for v in about.modelVariables}


def difference(got: Mapping[str, np.ndarray], expected: Mapping[str, np.ndarray]) -> float:
    """The largest difference of a variable, over its largest value or one unit."""
    scales = {name: max(1.0, np.max(np.abs(values))) for name, values in expected.items()}
    return max(float(np.max(np.abs(np.asarray(got[n]) - v))) / scales[n] for n, v in expected.items())


def test_it_is_valid_and_says_units_causality_and_start_values(tmp_path):
    path = unit(tmp_path, causes=[BRAKE_DRAG])
    assert validation.validate_fmu(str(path)) == []
    variables = {v.name: v for v in fmpy.read_model_description(str(path)).modelVariables}
    assert (variables["mass"].causality, variables["mass"].unit) == ("parameter", "kg")
    assert float(variables["mass"].start) == 1430.0
    assert float(variables["brake_drag"].start) == 38.0
    assert (variables["drive_torque"].causality, variables["drive_torque"].unit) == ("input", "N m")
    assert (variables["speed"].causality, variables["speed"].unit) == ("output", "m/s")
    assert all(v.description for v in variables.values())
    files = zipfile.ZipFile(path).namelist()
    assert files[0] == "modelDescription.xml"
    assert {"sources/car.h", "sources/car.c", "sources/car_fmi2.c"} <= set(files)


@pytest.mark.parametrize(
    ("speed", "torque", "brakes"),
    [(0.0, 260.0, 0.0), (8.0, 0.0, 1700.0), (0.0, 0.0, 900.0)],
    ids=["go", "stop", "rest"],
)
def test_fmpy_runs_it_as_python_does(tmp_path, speed, torque, brakes):
    path = runnable(tmp_path, causes=[BRAKE_DRAG])
    step = 0.004  # s between communications: four steps of the model
    time, inputs = stop_and_go(6.0, step)
    inputs = {name: np.zeros(time.size) for name in inputs} | {"drive_torque": torque, "brake_torque": brakes}
    start = {"start_speed": speed, "drive_torque": torque, "brake_torque": brakes}
    got = fmpy.simulate_fmu(str(path), stop_time=6.0, step_size=step, output_interval=step, start_values=start)
    np.testing.assert_allclose(got["time"], time, rtol=0, atol=1e-9)
    car = exported_vehicle(given(tmp_path, causes=[BRAKE_DRAG]), "front")
    assert difference(got, simulated(car, time, inputs, speed, substeps=4)) <= 1e-9


def test_a_learned_law_drives_the_unit_as_it_does_python(tmp_path):
    learned = {"extensions": {LEARNED: LEARNED_SIZES}, "laws": {LEARNED: LEARNED_LAW}, "verdict": "adequate"}
    path = runnable(tmp_path, **learned)
    step = 0.004  # s between communications: four steps of the model
    time, inputs = stop_and_go(3.0, step)
    inputs = {name: np.zeros(time.size) for name in inputs} | {"drive_torque": 260.0}
    start = {"start_speed": 3.0, "drive_torque": 260.0}
    got = fmpy.simulate_fmu(str(path), stop_time=3.0, step_size=step, output_interval=step, start_values=start)
    car = exported_vehicle(given(tmp_path, **learned), "front")
    assert difference(got, simulated(car, time, inputs, 3.0, substeps=4)) <= 1e-9


def test_inputs_that_go_straight_drive_it_as_python_does(tmp_path):
    slave, references = slave_of(runnable(tmp_path, causes=[BRAKE_DRAG]), tmp_path)
    step = 0.004
    time, inputs = stop_and_go(9.0, step)
    car = exported_vehicle(given(tmp_path, causes=[BRAKE_DRAG]), "front")
    names, readings = list(inputs), list(car.graph.outputs)
    into, out = ([references[name] for name in group] for group in (names, readings))
    table = np.column_stack([inputs[name] for name in names])
    slave.setReal(into, table[0].tolist())
    slave.exitInitializationMode()
    rows = []
    for here, after in zip(table, [*table[1:], table[-1]], strict=True):
        slave.setReal(into, here.tolist())
        rows.append(slave.getReal(out))
        slave.setRealInputDerivatives(into, [1] * len(into), ((after - here) / step).tolist())
        slave.doStep(currentCommunicationPoint=step * (len(rows) - 1), communicationStepSize=step)
    slave.terminate()
    slave.freeInstance()
    got = dict(zip(readings, np.array(rows).T, strict=True))
    assert got["speed"].max() > 4.0
    assert difference(got, simulated(car, time, inputs, 0.0, substeps=4)) <= 1e-9


def test_parameters_and_the_start_speed_are_used(tmp_path):
    path = runnable(tmp_path)
    speeds = []
    for mass in (1430.0, 1800.0):
        result = fmpy.simulate_fmu(
            str(path),
            stop_time=3.0,
            step_size=0.01,
            output_interval=0.01,
            start_values={"start_speed": 15.0, "mass": mass, "drive_torque": 200.0},
        )
        assert result["speed"][0] == 15.0
        speeds.append(result["speed"][-1])
    assert 15.0 < speeds[1] < speeds[0] - 0.3


def test_a_state_that_was_kept_is_gone_back_to(tmp_path):
    slave, references = slave_of(runnable(tmp_path), tmp_path)
    slave.setReal([references["start_speed"], references["drive_torque"]], [20.0, 150.0])
    slave.exitInitializationMode()
    with pytest.raises(fmpy.fmi1.FMICallException):
        slave.setReal([references["mass"]], [1.0])  # fixed once it runs
    kept = slave.getFMUState()

    def run() -> float:
        for k in range(50):
            slave.doStep(currentCommunicationPoint=0.01 * k, communicationStepSize=0.01)
        return slave.getReal([references["speed"]])[0]

    first = run()
    slave.setFMUState(kept)
    assert run() == first != 20.0
    slave.freeFMUState(kept)
    slave.terminate()
    slave.freeInstance()


def test_without_a_compiler_it_holds_its_source_alone(tmp_path, monkeypatch):
    monkeypatch.setattr(fmu.shutil, "which", lambda name: None)
    made = make(given(tmp_path), "fmu", ExportOptions("car"))
    assert any(note.startswith("source code only (no C compiler found)") for note in made.notes)
    (tmp_path / "car.fmu").write_bytes(made.files["car.fmu"])
    assert validation.validate_fmu(str(tmp_path / "car.fmu")) == []
    assert not [name for name in zipfile.ZipFile(tmp_path / "car.fmu").namelist() if name.startswith("binaries")]


def test_its_source_compiles_without_a_warning_and_needs_no_header_of_others(tmp_path):
    archive = zipfile.ZipFile(unit(tmp_path))
    archive.extractall(tmp_path)
    files = [entry.get("name", "") for entry in Xml.fromstring(archive.read("modelDescription.xml")).iter("File")]
    build(tmp_path / "sources", files, "car.so", "-shared", "-fPIC")


def test_the_same_parameters_give_the_same_bytes(tmp_path):
    one, other = made("{}"), make(given(tmp_path), "fmu", ExportOptions("car")).files["car.fmu"]
    assert one == other
    assert zipfile.ZipFile(io.BytesIO(one)).infolist()[0].date_time[0] == 1980


@pytest.mark.parametrize(
    ("unit", "powers"),
    [
        ("N s^2/m^2", {"kg": 1, "m": -1}),
        ("N m s/rad", {"kg": 1, "m": 2, "s": -1, "rad": -1}),
        ("1/N", {"kg": -1, "m": -1, "s": 2}),
        ("m/s^2", {"m": 1, "s": -2}),
    ],
)
def test_base_units(unit, powers):
    assert exponents(unit) == powers
