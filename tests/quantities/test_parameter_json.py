"""Parameter files that a user wrote or edited: units are converted, and impossible values are refused."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import FORMAT


def entry(value: Any, unit: str, std: Any = 0.0, **changes: Any) -> dict[str, Any]:
    """An entry of a parameter file."""
    both = {"value": value, "std": std, "interval95": [value, value], "unit": unit, "meaning": "m", "source": "cg"}
    return {**both, "baseline": None, **changes}


def written(folder: Path, parameters: Any, **others: Any) -> Path:
    """A parameter file."""
    path = folder / "known.json"
    path.write_text(json.dumps({"format": FORMAT, "parameters": parameters, **others}), encoding="utf-8")
    return path


def test_compatible_units_are_converted_with_their_deviations(tmp_path: Path) -> None:
    parameters = {
        "frontal_area": entry(23.56, "ft^2", 0.1),
        "mass": entry(3501, "lb", 10, baseline=3400),
        "temperature": entry(20, "degC", 5, interval95=[10, 30]),
    }
    read = read_document(written(tmp_path, parameters)).parameters
    area, mass, air = (read[name] for name in parameters)
    assert (area.value, area.std, area.unit) == (pytest.approx(2.1887956), pytest.approx(0.0092903), "m^2")
    assert (mass.value, mass.baseline) == (pytest.approx(1588.0269), pytest.approx(1542.2141))
    assert (air.value, air.std, air.unit) == (pytest.approx(293.15), pytest.approx(5.0), "K")
    assert air.interval95 == pytest.approx((283.15, 303.15))


@pytest.mark.parametrize(
    ("wrong", "says"),
    [
        ({"frontal_area": entry(2.2, "m")}, "'m' is not a unit of area \\(m\\^2\\)"),
        ({"mass": entry(1.5, "ton")}, "ambiguous"),
        ({"mass": entry(1.5, "9**(9**9)")}, "not a unit"),
        ({"drag_area": entry(-5, "m^2")}, "lies outside 0.05 to 50 m\\^2"),
        ({"wheel_inertia": entry(-5, "kg m^2")}, "lies outside"),
        ({"wheel_radius": entry(0.0, "m")}, "lies outside"),
        ({"wheel_radius": entry(0.3, "km")}, "lies outside"),
        ({"wheel_radius": entry(float("nan"), "m")}, "not finite"),
        ({"wheel_radius": entry(10**400, "m", interval95=[0, 1])}, "not finite"),
        ({"wheel_radius": entry(0.3, "m", float("inf"))}, "not finite"),
        ({"wheel_radius": entry(0.3, "m", -0.01)}, "negative standard deviation"),
        ({"wheel_radius": entry(0.3, "m", interval95=[0.4, 0.2])}, "lower end lies above"),
        ({"wheel_radius": entry(0.3, "m", interval95=[0.4])}, "wrong type"),
        ({"wheel_radius": entry(0.3, "m", interval95="ab")}, "wrong type"),
        ({"wheel_radius": entry("0.3", "m", interval95=[0, 1])}, "has no number as value"),
        ({"wheel_radius": entry(True, "m")}, "wrong type"),
        ({"wheel_radius": None}, "lacks value"),
        ({"a b\n": entry(1.0, "")}, "has an invalid name"),
        ([1], "not a mapping"),
        ("abc", "not a mapping"),
    ],
)
def test_what_no_vehicle_has_is_refused(wrong: Any, says: str, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=says):
        read_document(written(tmp_path, wrong))


@pytest.mark.parametrize(
    ("key", "value"),
    [
        *(("correlation", wrong) for wrong in ("abc", [1], {"mass": "abc"}, {"mass": {"drag_area": "x"}})),
        ("correlation", {"mass": {"drag_area": 1.5}}),
        ("correlation", {"mass": {"drag_area": float("nan")}}),
        ("extensions", "abc"),
        ("extensions", {"headwind": "abc"}),
        ("extensions", {"headwind": {"headwind": entry(float("inf"), "m/s")}}),
    ],
)
def test_other_keys_of_a_wrong_type_are_refused(key: str, value: Any, tmp_path: Path) -> None:
    with pytest.raises(InputError):
        read_document(written(tmp_path, {}, **{key: value}))


def test_everything_wrong_is_reported_at_once(tmp_path: Path) -> None:
    wrong = {"mass": entry(1, "kg"), "drag_area": entry(-5, "m^2"), "wheel_radius": entry(0.3, "kg")}
    with pytest.raises(InputError) as caught:
        read_document(written(tmp_path, wrong, correlation="abc"))
    assert len(caught.value.findings) == 4


def test_texts_hold_one_line(tmp_path: Path) -> None:
    odd = entry(1500, "kg", source="cg\n[MODEL]\n\x1b[31m", meaning="mass\r\nPCX1 = 3")
    read = read_document(written(tmp_path, {"mass": odd})).parameters["mass"]
    assert (read.source, read.meaning) == ("cg [MODEL]  [31m", "mass  PCX1 = 3")


@pytest.mark.parametrize("text", ["[" * 100_000, '{"a":' * 100_000, "9" * 1_000_000, '"\\ud800"', "\x00"])
def test_a_file_of_any_nesting_or_length_is_refused(text: str, tmp_path: Path) -> None:
    path = tmp_path / "deep.json"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError):
        read_document(path)
