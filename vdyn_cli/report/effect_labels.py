"""Names of effects on a page: their labels in the catalog."""

from __future__ import annotations

import math

from vdyn_cli.effects import Effect, catalog
from vdyn_cli.report import typography


def label(effect: str) -> str:
    """The effect as a noun phrase, "a headwind"; the plain name of a free profile, which the catalog does not have."""
    found = _effect(effect)
    return found.label if found else typography.name(effect)


def row_label(effect: str) -> str:
    """The effect as a noun phrase without its article, for use in a table."""
    return bare(label(effect))


def bare(text: str) -> str:
    """A noun phrase without its article."""
    for article in ("a ", "an ", "the "):
        if text.startswith(article):
            return text[len(article) :]
    return text


def combined(effects: str) -> str:
    """Effects that act together, ``headwind+tire_warmup``, as a noun phrase."""
    return " and ".join(label(part) for part in effects.split("+"))


def amplitude(effect: str, value: float) -> str:
    """An amplitude of the effect in the unit of its first unknown; in percent if dimensionless, empty for NaN."""
    found = _effect(effect)
    if not math.isfinite(value):
        return ""
    unit = next(iter(found.unknowns.values())).unit if found else ""
    if not unit and found:
        return f"{typography.shortest(100 * value)}{typography.NARROW}%"
    return f"{typography.shortest(value)} {typography.unit(unit)}".strip()


def _effect(name: str) -> Effect | None:
    return next((e for e in catalog() if e.name == name), None)
