"""The JSON schema of each description, for completion and checks in editors."""

from __future__ import annotations

import json
from typing import Any

from vdyn_cli.commands.explain import closest_topic
from vdyn_cli.project.pipeline import PipelineSpec
from vdyn_cli.steps import load_step, names


def json_schema(topic: str) -> str:
    """The schema of a step's description, or of the pipeline's.

    Raises
    ------
    InputError : no such step.
    """
    if topic == "pipeline":
        return _text(_with_vehicle_file(PipelineSpec.model_json_schema()))
    step = load_step(closest_topic(topic, names(), "step"))
    schema = _with_vehicle_file(step.spec.model_json_schema())
    channel = {"$ref": "#/$defs/Channel"}
    schema["properties"]["test"] = {"const": step.name}
    schema["properties"]["channels"] = {
        "type": "object",
        "additionalProperties": False,
        "properties": {n: {**channel, "description": f"{q.meaning}, {q.unit}"} for n, q in step.channels().items()},
    }
    return _text(schema)


def _with_vehicle_file(schema: dict[str, Any]) -> dict[str, Any]:
    """The vehicle may stand in a file of its own."""
    vehicle = schema["properties"]["vehicle"]
    ways = [{"$ref": "#/$defs/Vehicle"}, {"type": "string", "description": "a YAML file with these keys"}]
    schema["properties"]["vehicle"] = {**{k: v for k, v in vehicle.items() if k != "$ref"}, "anyOf": ways}
    return schema


def _text(schema: dict[str, Any]) -> str:
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"
