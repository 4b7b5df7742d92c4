"""Parameter sets: conversion to and from JSON, updates, and one message about all missing parameters."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from vdyn_cli import steps
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import (
    ESTIMATED_BY,
    FORMAT,
    Estimate,
    MissingParameterError,
    Parameters,
    to_document,
)
from vdyn_cli.quantities.vocabulary import PARAMETERS, TABLE


def some() -> Parameters:
    mass = Estimate.given(PARAMETERS["mass"], 1588.0, 2.0)
    drag = Estimate.of("drag_area", 0.55, 0.01, (0.53, 0.57), "coastdown")
    return Parameters({"mass": mass, "drag_area": drag}, {"drag_area": {"rolling_resistance": -0.9}})


def test_there_and_back(tmp_path: Path) -> None:
    path = tmp_path / "p.json"
    path.write_text(to_json({"format": FORMAT, **to_document(some())}))
    assert read_document(path).parameters == some()


def test_later_ones_take_the_place_of_earlier_ones() -> None:
    later = Parameters({"drag_area": Estimate.of("drag_area", 0.6, 0.01, (0.58, 0.62), "other")})
    both = some().updated(later)
    assert both["drag_area"].value == 0.6
    assert both["mass"].value == 1588.0


def test_everything_missing_is_said_at_once_with_who_gives_it() -> None:
    with pytest.raises(MissingParameterError) as caught:
        some().require("mass", "wheelbase", "cg_height", where="bump.yaml")
    said = str(caught.value)
    assert "wheelbase" in said
    assert "vdyn cg" in said
    assert "mass" not in said


def test_the_givers_are_the_steps_that_give() -> None:
    given = {name: step for step in steps.names() for name in steps.load_step(step).gives if name in TABLE}
    assert given == dict(ESTIMATED_BY)


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("{", "is not JSON"),
        ("[]", "not a parameter file"),
        ('{"format": "x"}', "not a parameter file"),
        (f'{{"format": "{FORMAT}", "parameters": {{"wheel_radius": {{"value": "r"}}}}}}', "wheel_radius"),
        (f'{{"format": "{FORMAT}", "parameters": {{"mass": {{"value": 1}}}}}}', "lacks std, interval95, unit, meaning"),
    ],
)
def test_a_file_that_is_none_is_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "k.json").write_text(text)
    with pytest.raises(InputError, match=says):
        read_document(tmp_path / "k.json")


def test_numbers_that_are_not_finite_become_null() -> None:
    assert json.loads(to_json({"a": float("nan"), "b": [float("inf"), 1.0]})) == {"a": None, "b": [None, 1.0]}


def test_what_one_step_gives_together_is_asked_for_together() -> None:
    with pytest.raises(MissingParameterError) as error:
        Parameters({}).require("tire_B", "cg_height", "tire_C", "yaw_inertia", where="validate")
    assert [f.what.split(" (")[0] for f in error.value.findings] == [
        "tire_B, tire_C are needed and not given",
        "cg_height",
        "yaw_inertia",
    ]
    assert "'tire_B: <number>', 'tire_C: <number>' under vehicle" in error.value.findings[0].remedy


def test_the_density_of_the_air_is_asked_for_by_the_weather_first() -> None:
    with pytest.raises(MissingParameterError, match=r"add .environment: \{temperature: 20 degC, pressure"):
        Parameters({}).require("air_density", where="c.yaml")
