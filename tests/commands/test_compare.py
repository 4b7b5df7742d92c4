"""``vdyn compare``: parameters that differ between two files by more than both uncertainties."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from tests.result_check import validator
from vdyn_cli.commands.run_compare import run_compare
from vdyn_cli.quantities.errors import InputError


def entry(value: float, half: float, unit: str = "m^2", interval: list[float] | None = None) -> dict[str, Any]:
    ends = interval or [value - half, value + half]
    return {"value": value, "std": half / 1.96, "interval95": ends, "unit": unit, "meaning": "", "source": "coastdown"}


def write(path: Path, parameters: dict[str, Any], **more: Any) -> Path:
    document = {"format": "vdyn/parameters/1", "step": "coastdown", "parameters": parameters} | more
    path.write_text(json.dumps(document), encoding="utf-8")
    return path


def compared(old: Path, new: Path) -> tuple[dict[str, Any], int]:
    files = old, new
    text, code = run_compare(*files, as_json=True)
    document = json.loads(text)
    validator("comparison").validate(document)
    assert document["sentence"] == run_compare(*files, as_json=False)[0].splitlines()[0]
    return document, code


@pytest.mark.parametrize(
    ("old", "new", "moved"),
    [
        (entry(0.60, 0.03), entry(0.64, 0.03), False),  # 0.04 < 0.0424
        (entry(0.60, 0.03), entry(0.65, 0.03), True),
        (entry(0.60, 0.03), entry(6500.0, 1.0, "cm^2"), True),  # 0.05 > 0.03
        (entry(0.60, 0.03), entry(6200.0, 1.0, "cm^2"), False),
        (entry(0.60, 0.0, interval=[0.59, 0.70]), entry(0.65, 0.01), False),  # the side of the other value
        (entry(0.60, 0.0, interval=[0.50, 0.61]), entry(0.65, 0.01), True),
        (entry(0.60, 0.0), entry(0.60 * (1 + 1e-12), 0.0), False),  # exact values, but for their last digits
        (entry(0.60, 0.0), entry(0.61, 0.0), True),
    ],
)
def test_moved_is_beyond_both_uncertainties(old: Any, new: Any, moved: bool, tmp_path: Path) -> None:
    document, code = compared(
        write(tmp_path / "old.json", {"drag_area": old}), write(tmp_path / "new.json", {"drag_area": new})
    )
    (row,) = document["parameters"]
    assert (row["moved"], document["moved"], code) == (moved, moved, int(moved))
    assert row["unit"] == "m^2"


def test_equal_values_have_the_statistic_zero(tmp_path: Path) -> None:
    same = write(tmp_path / "a.json", {"drag_area": entry(0.60, 0.03), "exact": entry(1.0, 0.0)})
    lines = run_compare(same, same, as_json=False)[0].splitlines()
    assert [line.split()[-2] for line in lines if line.startswith(("  drag_area", "  exact"))] == ["0.0", "0.0"]


def test_what_one_file_lacks_and_what_both_share_is_said(tmp_path: Path) -> None:
    old = {"drag_area": entry(0.6, 0.03), "mass": entry(1500.0, 1.0, "kg")}
    new = {"drag_area": entry(0.6, 0.03), "frontal_area": entry(2.2, 0.1)}
    inputs = {"provenance": {"inputs": {"a.csv": "1", "b.csv": "2"}}}
    extended = {"road_grade": {"road_grade": entry(0.001, 0.0001, "")}}
    named = {"diagnosis": {"verdict": "named"}, "extensions": extended, "provenance": {"inputs": {"c.csv": "2"}}}
    document, code = compared(
        write(tmp_path / "old.json", old, diagnosis={"verdict": "adequate"}, **inputs),
        write(tmp_path / "new.json", new, **named),
    )
    assert code == 0
    assert document["only_old"] == ["mass"]
    assert document["only_new"] == ["frontal_area", "road_grade.road_grade"]
    assert document["verdicts"] == ["coastdown: adequate -> named"]
    assert " 1 of the input files is in both" in document["assumed"]
    whole = write(tmp_path / "parameters.json", old, **inputs | {"step": "pipeline"})  # which does not list the logs
    assert "At least 1 of the input files is in both" in compared(whole, tmp_path / "new.json")[0]["assumed"]


def test_files_that_cannot_be_compared_are_input_errors(tmp_path: Path) -> None:
    one = write(tmp_path / "one.json", {"drag_area": entry(0.6, 0.03)})
    other = write(tmp_path / "other.json", {"mass": entry(1500.0, 1.0, "kg")})
    with pytest.raises(InputError, match="no parameter in common"):
        run_compare(one, other, as_json=False)
    with pytest.raises(InputError, match="does not exist"):
        run_compare(one, tmp_path / "missing.json", as_json=False)
    refused = write(tmp_path / "refused.json", {}, refused="the parameters are not determined")
    with pytest.raises(InputError, match="contains no parameters"):
        run_compare(one, refused, as_json=False)
