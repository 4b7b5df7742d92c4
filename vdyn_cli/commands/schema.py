"""JSON schemas of test descriptions, for completion in editors, and of result files, for scripts."""

from __future__ import annotations

import json
from typing import Any

from vdyn_cli.commands.explain import closest_topic
from vdyn_cli.description.quantity_field import described
from vdyn_cli.project.pipeline import PipelineSpec
from vdyn_cli.quantities.check_schema import CheckDocument
from vdyn_cli.quantities.plan_schema import PlanDocument
from vdyn_cli.quantities.result_schema import (
    ChannelsDocument,
    ComparisonDocument,
    ParametersDocument,
    ResultDocument,
    document_schema,
)
from vdyn_cli.steps import load_step, names

TOPICS = ("pipeline", "result", "parameters", "channels", "check", "plan", "comparison")  # in addition to the steps


def json_schema(topic: str) -> str:
    """The JSON schema (draft 2020-12) of a description or of a result file.

    Parameters
    ----------
    topic : a step or ``pipeline`` for its YAML, ``result`` for the JSON of a step, ``parameters`` for the pipeline's
        ``parameters.json``; ``channels``, ``check``, ``plan`` and ``comparison`` for the JSON of these commands.

    Raises
    ------
    InputError : the topic is unknown.
    """
    closest_topic(topic, (*names(), *TOPICS), "schema")
    schemas = {
        "pipeline": lambda: _with_vehicle_file(PipelineSpec.model_json_schema()),
        "result": lambda: document_schema(ResultDocument),
        "parameters": lambda: document_schema(ParametersDocument),
        "channels": lambda: document_schema(ChannelsDocument),
        "check": lambda: document_schema(CheckDocument),
        "plan": lambda: document_schema(PlanDocument),
        "comparison": lambda: document_schema(ComparisonDocument),
    }
    schema = schemas[topic]() if topic in schemas else _step_schema(topic)
    return json.dumps({"$schema": "https://json-schema.org/draft/2020-12/schema", **schema}, indent=2) + "\n"


def _step_schema(name: str) -> dict[str, Any]:
    step = load_step(name)
    schema = _with_vehicle_file(step.spec.model_json_schema())
    keys = schema["properties"]
    ways = [{"$ref": "#/$defs/Channel"}, {"$ref": "#/$defs/KnownChannel"}]
    channels = {n: q for one in (step, *step.manoeuvres.values()) for n, q in one.channels().items()}
    keys["test"] = {"const": step.name, "description": keys["test"]["description"]}
    keys["channels"] = {
        "type": "object",
        "description": keys["channels"]["description"],
        "additionalProperties": False,
        "properties": {n: {"anyOf": ways, "description": described(q)} for n, q in channels.items()},
    }
    return schema


def _with_vehicle_file(schema: dict[str, Any]) -> dict[str, Any]:
    """The schema in which ``vehicle`` may also be the name of a file."""
    vehicle = schema["properties"]["vehicle"]
    ways = [{"$ref": "#/$defs/Vehicle"}, {"type": "string", "description": "a YAML file with these keys"}]
    schema["properties"]["vehicle"] = {**{k: v for k, v in vehicle.items() if k != "$ref"}, "anyOf": ways}
    return schema
