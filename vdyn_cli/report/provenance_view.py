"""Findings, inputs, versions and settings as texts for a page."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from vdyn_cli.project.result_document import Provenance
from vdyn_cli.quantities.errors import Finding
from vdyn_cli.report import typography


def finding_texts(source: Finding) -> dict[str, str]:
    """The texts of a finding, by field, without characters that HTML forbids."""
    return {
        "where": typography.clean(source.where),
        "what": typography.clean(source.what),
        "got": typography.clean(source.got),
        "remedy": typography.clean(source.remedy),
    }


def outline(value: Any, indent: str = "", width: int = 108) -> list[str]:
    """Lines of a nested mapping in the style of YAML; a value that fits into ``width`` characters takes one line."""
    lines = []
    items = value.items() if isinstance(value, Mapping) else (("-", v) for v in value)
    for key, inner in items:
        head = f"{indent}{typography.clean(key)}" + ("" if key == "-" else ":")
        flat = json.dumps(inner, ensure_ascii=False, default=str)
        if isinstance(inner, (Mapping, list, tuple)) and inner and len(head) + len(flat) > width:
            lines += [head, *outline(inner, indent + "  ", width)]
        else:
            lines.append(f"{head} {typography.clean(flat)}")
    return lines


@dataclass(frozen=True)
class ProvenanceView:
    """Inputs with their sha256, and settings, versions and command as texts."""

    inputs: tuple[tuple[str, str], ...]
    settings: str
    versions: str
    command: str


def provenance_view(source: Provenance) -> ProvenanceView:
    """The provenance of a result as texts."""
    return ProvenanceView(
        tuple((typography.clean(k), typography.clean(v)) for k, v in source.inputs.items()),
        "\n".join(outline(source.settings)) if source.settings else "",
        ", ".join(f"{k} {v}" for k, v in source.versions.items()),
        typography.clean(source.command),
    )
