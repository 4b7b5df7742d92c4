"""Schemas: each key has a description, and the shipped descriptions and the results are valid."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import jsonschema
import pytest
import yaml

from tests.result_check import check_result, checked, validator
from vdyn_cli import steps
from vdyn_cli.commands.schema import json_schema
from vdyn_cli.project.execute import execute
from vdyn_cli.project.result_document import to_json
from vdyn_cli.quantities import result_schema
from vdyn_cli.quantities.errors import InputError


def properties(schema: dict[str, Any]) -> Iterator[tuple[str, dict[str, Any]]]:
    """Every key of a schema, of its definitions, and of objects written in place, with its place."""
    for place, part in {"": schema, **schema.get("$defs", {})}.items():
        for key, value in part.get("properties", {}).items():
            yield f"{place}.{key}", value
            yield from ((f"{place}.{key}{inner}", v) for inner, v in properties(value))


@pytest.mark.parametrize("topic", [*steps.names(), "pipeline"])
def test_every_key_of_a_description_has_one_line_that_describes_it(topic: str) -> None:
    found = dict(properties(json.loads(json_schema(topic))))
    assert found
    bare = [place for place, value in found.items() if not value.get("description", "").strip()]
    assert not bare, f"keys without a description: {', '.join(bare)}"
    long = [place for place, value in found.items() if "\n" in value["description"]]
    assert not long, f"descriptions of more than one line: {', '.join(long)}"


def test_every_key_of_a_result_has_a_description() -> None:
    models = [m for m in vars(result_schema).values() if getattr(m, "__module__", "") == result_schema.__name__]
    fields = {f"{m.__name__}.{n}": f for m in models if hasattr(m, "model_fields") for n, f in m.model_fields.items()}
    assert len(fields) > 30
    assert not [name for name, field in fields.items() if not field.description]


@pytest.mark.parametrize("path", sorted((Path(__file__).parents[2] / "configs").glob("*.yaml")), ids=lambda p: p.stem)
def test_shipped_descriptions_follow_their_schema(path: Path) -> None:
    description = yaml.safe_load(path.read_text())
    topic = description.get("test", "pipeline" if "pipeline" in description else "")
    if topic:
        validator(topic).validate(description)
    else:
        vehicle = json.loads(json_schema("coastdown"))
        jsonschema.validate(description, {**vehicle["$defs"]["Vehicle"], "$defs": vehicle["$defs"]})


def test_a_result_follows_its_schema_and_a_changed_one_does_not(root: Path) -> None:
    document = json.loads(to_json(execute("tire", root / "configs" / "tire.yaml", (), 0.05).document))
    check_result(document)
    assert document["diagnosis"]["verdict"] == "adequate"
    for change in (
        {"diagnosis": {**document["diagnosis"], "verdict": "probably"}},
        {"fit": {**document["fit"], "rmse": 1.0}},
        {"parameters": {"tire_D": {"value": 1.0}}},
        {"sentence": None},
    ):
        with pytest.raises(jsonschema.ValidationError):
            check_result({**document, **change})


def test_numbers_that_are_not_finite_are_null_and_allowed() -> None:
    entry = {"value": float("nan"), "std": 0.0, "interval95": [0.0, float("inf")], "unit": "", "meaning": "m"}
    document = {
        "format": "vdyn/parameters/1",
        "step": "pipeline",
        "title": "a day",
        "parameters": {"mass": {**entry, "baseline": None, "source": "given"}},
        "correlation": {},
        "extensions": {},
        "missing": {},
        "steps": {},
        "provenance": {"inputs": {}, "versions": {"vdyn_cli": "0"}, "command": "vdyn pipeline day.yaml"},
    }
    assert json.loads(checked()(document))["parameters"]["mass"]["value"] is None


def test_an_unknown_schema_is_refused_with_the_closest_names() -> None:
    with pytest.raises(InputError, match="did you mean result"):
        json_schema("results")
