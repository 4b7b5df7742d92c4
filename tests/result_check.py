"""Results against the schemas that ``vdyn schema result`` and ``vdyn schema parameters`` publish."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from functools import cache
from typing import Any

import jsonschema

from vdyn_cli.commands.schema import json_schema
from vdyn_cli.project.result_document import to_json


@cache
def validator(topic: str) -> jsonschema.Draft202012Validator:
    """Of a published schema, which is itself valid."""
    schema = json.loads(json_schema(topic))
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


def check_result(document: Mapping[str, Any]) -> None:
    """Raise ``jsonschema.ValidationError`` where a written document departs from its published schema."""
    validator("parameters" if document.get("step") == "pipeline" else "result").validate(document)


def checked(write: Callable[[Mapping[str, Any]], str] = to_json) -> Callable[[Mapping[str, Any]], str]:
    """``to_json`` that checks what it writes."""

    def checking(document: Mapping[str, Any]) -> str:
        text = write(document)
        check_result(json.loads(text))
        return text

    return checking
