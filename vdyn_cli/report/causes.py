"""Causes by the words of the catalogue, as a page names them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from vdyn_cli.effects import Effect, catalogue
from vdyn_cli.report import words


def label(effect: str) -> str:
    """The cause as a noun phrase, "a headwind"; a free profile, or what the catalogue lacks, by its name."""
    found = _effect(effect)
    return found.label if found else words.name(effect)


def told(entry: Mapping[str, Any]) -> str:
    """The noun phrase that a document's entry of a cause has with it, or the catalogue's."""
    return words.prose(entry.get("label") or "") or label(str(entry.get("effect", "")))


def bare(text: str) -> str:
    """A noun phrase without its article, as it stands in a table."""
    for article in ("a ", "an ", "the "):
        if text.startswith(article):
            return text[len(article) :]
    return text


def combined(effects: Any) -> str:
    """Causes that go together, "headwind+tire_warmup", in words."""
    return joined([label(part) for part in str(effects).split("+")])


def joined(named: Sequence[str]) -> str:
    return " and ".join(named)


def size(effect: str, value: float) -> str:
    """A size of the cause in the unit of its first unknown; shares in per cent."""
    found = _effect(effect)
    if not math.isfinite(value):
        return ""
    unit = next(iter(found.unknowns.values())).unit if found else ""
    if not unit and found:
        return f"{words.plain(100 * value)}{words.NARROW}%"
    return f"{words.plain(value)} {words.unit(unit)}".strip()


def _effect(name: str) -> Effect | None:
    return next((e for e in catalogue() if e.name == name), None)
