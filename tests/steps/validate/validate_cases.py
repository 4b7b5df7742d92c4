"""Drives for the tests of validate: the sample drives, and the parameters of the sample's steps about the truth."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from tests.plant.drive import truth
from tests.plant.vehicle import REFERENCE
from vdyn_cli.project.inputs import Inputs, gather
from vdyn_cli.quantities.parameters import Estimate, Parameters, to_document
from vdyn_cli.quantities.vocabulary import PARAMETERS
from vdyn_cli.steps import load_step
from vdyn_cli.steps.validate.problem import ValidateProblem

# Standard deviations as the steps reach on the sample day, and of what a data sheet says.
STD = {
    "mass": 2.0,
    "wheel_radius": 0.0005,
    "cg_to_front": 0.0009,
    "cg_height": 0.0008,
    "pitch_inertia": 1.7,
    "suspension_stiffness_front": 9.0,
    "suspension_stiffness_rear": 7.0,
    "suspension_damping_front": 0.5,
    "suspension_damping_rear": 0.6,
    "tire_vertical_stiffness": 46.0,
    "wheel_inertia": 0.0007,
    "tire_B": 0.068,
    "tire_C": 0.0037,
    "tire_D": 0.0005,
    "tire_E": 0.019,
    "tire_relaxation_length": 0.02,
    "rolling_resistance": 8e-5,
    "drag_area": 0.0088,
    "driveline_efficiency": 0.001,
    "driveline_inertia": 0.1,
    "shaft_stiffness_left": 29.0,
    "shaft_stiffness_right": 71.0,
    "shaft_damping_left": 0.7,
    "shaft_damping_right": 14.0,
    "brake_share_front": 0.02,
}
EXACT = ("wheelbase", "drag_height", "gear_ratio")
CORRELATION = {"rolling_resistance": {"drag_area": -0.57}, "drag_area": {"rolling_resistance": -0.57}}


def true_parameters(wrong: Mapping[str, float] | None = None, without: tuple[str, ...] = ()) -> Parameters:
    """The true parameters with these standard deviations; some are off by a given number of them."""
    true = truth(REFERENCE) | {
        "cg_to_front": REFERENCE.cg_to_front,
        "tire_vertical_stiffness": REFERENCE.tire_vertical_stiffness,
        "driveline_efficiency": 1.0,
        "brake_share_front": 0.65,
    }
    values = {n: true[n] for n in (*STD, *EXACT)} | {
        "unsprung_mass_front": REFERENCE.unsprung_mass_front,
        "unsprung_mass_rear": REFERENCE.unsprung_mass_rear,
        "track_front": REFERENCE.track_front,
        "track_rear": REFERENCE.track_rear,
    }
    off = wrong or {}
    found = {
        n: Estimate.given(PARAMETERS[n], v + off.get(n, 0.0) * STD.get(n, 0.0), STD.get(n, 0.0), "truth")
        for n, v in values.items()
        if n not in without
    }
    return Parameters(found, {} if {"rolling_resistance", "drag_area"} & set(without) else CORRELATION)


def described(root: Path, folder: Path, drives: tuple[int, ...] = (1,), **settings: Any) -> Path:
    """The shipped description of some of the drives, without its vehicle, in a separate folder."""
    data = yaml.safe_load((root / "configs" / "validate.yaml").read_text(encoding="utf-8"))
    data.pop("vehicle")
    data["runs"] = [data["runs"][k - 1] for k in drives]
    for run in data["runs"]:
        run["log"] = str((root / "configs" / run["log"]).resolve())
    data["settings"].update(settings)
    path = folder / "validate.yaml"
    path.write_text(yaml.safe_dump(data), encoding="utf-8")
    return path


def known_file(folder: Path, parameters: Parameters) -> Path:
    path = folder / "known.json"
    document = {"format": "vdyn/parameters/1", **to_document(parameters)}
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def prepared(found: Inputs) -> ValidateProblem:
    """The problem of some inputs."""
    return ValidateProblem(found.spec, tuple(found.data), found.known)


def inputs(root: Path, folder: Path, parameters: Parameters, drives: tuple[int, ...] = (1,), **settings: Any) -> Inputs:
    path = described(root, folder, drives, **settings)
    return gather(load_step("validate"), path, [known_file(folder, parameters)])
