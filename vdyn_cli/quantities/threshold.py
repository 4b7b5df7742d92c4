"""Thresholds of a policy: value with unit, meaning and reason, and their listing as text."""

from __future__ import annotations

from dataclasses import field, fields
from textwrap import fill
from typing import Any, TypeVar

N = TypeVar("N", int, float)


def threshold(value: N, unit: str, meaning: str, reason: str) -> N:
    """A dataclass field of a policy with its default, unit, meaning and reason, for ``thresholds_text``."""
    return field(default=value, metadata={"unit": unit, "meaning": meaning, "reason": reason})


def thresholds_text(policy: Any) -> str:
    """Every threshold of a policy with its value, unit, meaning and reason, one paragraph each.

    ``policy`` : a dataclass whose fields are defined by ``threshold``.
    """
    paragraphs = []
    for one in fields(policy):
        unit = f" {one.metadata['unit']}" if one.metadata["unit"] else ""
        text = f"{one.metadata['meaning']}.\n{one.metadata['reason']}".split("\n")
        lines = [fill(line, 100, initial_indent="    ", subsequent_indent="    ") for line in text]
        paragraphs.append("\n".join([f"{one.name} = {getattr(policy, one.name):g}{unit}", *lines]))
    return "\n\n".join(paragraphs) + "\n"
