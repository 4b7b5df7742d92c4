"""Thresholds of a policy as text: value with unit, meaning and reason.

A policy is a dataclass with a default for each threshold, described by the string below it (an attribute docstring):
``[unit] meaning. Reason.``, without the bracket where the threshold has no unit.
"""

from __future__ import annotations

import ast
import re
from inspect import getsource
from itertools import pairwise
from textwrap import fill
from typing import Any, NamedTuple

DESCRIPTION = re.compile(r"(?:\[(.*?)\] )?(.*?\.) (.*)")


class Threshold(NamedTuple):
    """The description of a threshold; its meaning and reason are sentences, its unit may be empty."""

    unit: str
    meaning: str
    reason: str


def described_thresholds(policy: type) -> dict[str, Threshold]:
    """The description of each threshold of a policy, inherited ones first; those without one are omitted."""
    found = {}
    for owner in reversed(policy.__mro__[:-1]):
        definition = ast.parse(getsource(owner)).body[0]
        assert isinstance(definition, ast.ClassDef)
        for field, text in pairwise(definition.body):
            if isinstance(field, ast.AnnAssign) and isinstance(text, ast.Expr):
                whole = DESCRIPTION.fullmatch(" ".join(ast.literal_eval(text.value).split()))
                if whole is not None:
                    found[ast.unparse(field.target)] = Threshold(whole[1] or "", whole[2], whole[3])
    return found


def thresholds_text(policy: Any) -> str:
    """Every described threshold of a policy with its value, unit, meaning and reason, one paragraph each."""
    paragraphs = []
    for name, one in described_thresholds(type(policy)).items():
        lines = [fill(line, 100, initial_indent="    ", subsequent_indent="    ") for line in (one.meaning, one.reason)]
        paragraphs.append("\n".join([f"{name} = {getattr(policy, name):g} {one.unit}".rstrip(), *lines]))
    return "\n\n".join(paragraphs) + "\n"
