"""Validation against drives of a plant with a true differential, open and locked: silent where the model is right."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.bench.hidden_logs import make
from tests.plant.hidden import Scenario
from tests.plant.vehicle import Vehicle
from tests.steps.validate.validate_cases import inputs, true_parameters
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate.problem import ValidateProblem

SILENT = ("adequate", "not_testable")


class _Locked(Scenario):
    """The scenario's car with its differential locked."""

    @property
    def vehicle(self) -> Vehicle:
        return super().vehicle.but(differential_locked=True)


def described(scenario: Scenario, folder: Path, differential: str) -> Path:
    path = make(scenario, folder).description
    described = yaml.safe_load(path.read_text(encoding="utf-8"))
    described["settings"]["differential"] = differential
    path.write_text(yaml.safe_dump(described), encoding="utf-8")
    return path


MANY = [pytest.param(seed, marks=pytest.mark.thorough) for seed in range(7202, 7213)]  # twelve take 1.5 min


@pytest.mark.slow  # whole diagnoses
@pytest.mark.parametrize("seed", [7201, *MANY])
def test_drives_of_a_car_with_an_open_differential_show_no_error(seed: int, tmp_path: Path) -> None:
    path = described(Scenario("validate", {}, seed), tmp_path, "open")
    assert execute("validate", path).document["diagnosis"]["verdict"] in SILENT


@pytest.mark.slow
@pytest.mark.thorough  # the description that is used seldom
@pytest.mark.parametrize("seed", [7301])
def test_a_locked_differential_shows_no_error_where_the_description_says_so(seed: int, tmp_path: Path) -> None:
    path = described(_Locked("validate", {}, seed), tmp_path, "locked")
    assert execute("validate", path).document["diagnosis"]["verdict"] in SILENT


def test_two_motors_have_no_differential_to_lock(root: Path, tmp_path: Path) -> None:
    described = yaml.safe_load((root / "configs" / "validate.yaml").read_text(encoding="utf-8"))
    described["vehicle"] = str(root / "configs" / "vehicle.yaml")
    for run in described["runs"]:
        run["log"] = str(root / "configs" / run["log"])
    torque = described["channels"].pop("drive_torque")
    described["channels"] |= {f"drive_torque_{side}": torque for side in ("left", "right")}
    described["settings"]["differential"] = "locked"
    path = tmp_path / "sides.yaml"
    path.write_text(yaml.safe_dump(described), encoding="utf-8")
    found = gather(load_step("validate"), path, ())
    problem = ValidateProblem(found.spec, found.data, found.known)
    with pytest.raises(InputError, match="no differential"):
        _ = problem.model


@pytest.mark.slow
def test_torques_of_two_motors_drive_the_car_without_the_gear_ratio(root: Path, tmp_path: Path) -> None:
    """On each side, half of the torque at the wheels."""
    found = inputs(root, tmp_path, true_parameters())
    axle = ValidateProblem(found.spec, tuple(log.between(0.0, 12.0) for log in found.data), found.known)
    torque = found.spec.channels["drive_torque"]
    sides = {f"drive_torque_{side}": torque for side in ("left", "right")}
    channels = {name: channel for name, channel in found.spec.channels.items() if name != "drive_torque"} | sides
    ratio = found.known.value("gear_ratio", 0.0)
    logs = tuple(
        replace(log, channels={**log.channels, **dict.fromkeys(sides, log["drive_torque"] * ratio / 2)})
        for log in axle.logs
    )
    two = ValidateProblem(found.spec.model_copy(update={"channels": channels}), logs, found.known)
    assert two.model.inputs[:2] == ("drive_torque_left", "drive_torque_right")
    for one, other in zip(axle.baseline.first, two.baseline.first, strict=True):
        assert np.max(np.abs(one.values["speed"] - other.values["speed"])) < 0.03
    assert two.publish().fit.rms == pytest.approx(axle.publish().fit.rms, rel=0.1)
