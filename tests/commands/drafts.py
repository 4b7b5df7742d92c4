"""Drafts of descriptions, and logs to draft them from."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from vdyn_cli.project.drafting.description_draft import DescriptionDraft, draft_description
from vdyn_cli.steps import load_step


def draft(step: str, *paths: Path) -> tuple[DescriptionDraft, dict[str, Any]]:
    found = draft_description(load_step(step), paths, paths[0].parent)
    return found, yaml.safe_load(found.text)


def columns(channels: Mapping[str, Mapping[str, Any]]) -> dict[str, tuple[str, str]]:
    return {n: (c["column"], c["unit"].replace("N m", "Nm")) for n, c in channels.items()}


def table(path: Path, **columns_: Any) -> Path:
    """A log of columns; the last word of each name is its unit in brackets."""
    named = [n.rsplit("_", 1) for n in columns_]
    header = ",".join(f"{n} [{unit.replace('per', '/')}]" if unit else n for n, unit in named)
    np.savetxt(path, np.column_stack(list(columns_.values())), delimiter=",", header=header, comments="", fmt="%.12g")
    return path


WAVE = np.sin(np.arange(600) / 30.0)
