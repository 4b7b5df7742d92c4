"""A step's result as the JSON document that other steps, scripts and people read."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.io.files import sha256
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.parameters import FORMAT, to_document
from vdyn_cli.quantities.result import Result


def step_document(result: Result, inputs: Inputs, command: str, known_files: Sequence[Path]) -> dict[str, Any]:
    """The result with its provenance; nothing in it depends on when or where it was made."""
    fit = result.fit
    return {
        "format": FORMAT,
        "step": result.step,
        "sentence": result.sentence,
        **to_document(result.parameters),
        "fit": {
            "runs": list(fit.runs),
            "rms": fit.rms,
            "noise_floor": fit.noise_floor,
            "unit": fit.unit,
            "unknowns": list(fit.unknowns),
            "interval_unit": fit.interval_unit,
            "interval_units": fit.interval_units,
            "held_out_rms": fit.held_out_rms,
            "warnings": list(fit.warnings),
        },
        "findings": [asdict(f) for f in result.findings],
        **result.extra,
        **_effects(result),
        "diagnosis": result.diagnosis and result.diagnosis.model_dump(),
        "provenance": {
            "inputs": fingerprints(inputs.files, inputs.source.path.parent, known_files),
            "settings": inputs.spec.model_dump(mode="json", exclude_none=True),
            "versions": versions(),
            "command": command,
        },
    }


def _effects(result: Result) -> dict[str, Any]:
    """Amplitudes of the effects that the model was extended by, under ``effects``; nothing where there are none."""
    found = {
        n: {"value": e.value, "std": e.std, "interval95": list(e.interval95)} for n, e in result.amplitudes.items()
    }
    return {"effects": found} if found else {}


def fingerprints(files: Sequence[Path], folder: Path, known_files: Sequence[Path]) -> dict[str, str]:
    """sha256 of every input, under its path from the description's folder; parameter files under their bare name."""
    known = set(known_files)
    return {file.name if file in known else os.path.relpath(file, folder): sha256(file) for file in files}


def step_command(step: str, path: Path, known_files: Sequence[Path], level: float | None = POLICY.level) -> str:
    """The command that makes this result, with bare file names."""
    known = [f"--known {file.name}" for file in known_files]
    how = [] if level == POLICY.level else ["--no-diagnose"] if level is None else [f"--level {level:.4g}"]
    return " ".join(["vdyn", step, path.name, *known, *how])


@cache
def versions() -> dict[str, str]:
    """The versions that a result can depend on."""
    found = {}
    for package in ("vdyn_cli", "numpy", "scipy", "casadi", "llvmlite"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "absent"
    return found


def to_json(document: Mapping[str, Any]) -> str:
    """Readable JSON text; numbers that are not finite become null, as JSON has none."""
    return json.dumps(_plain(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"


def _plain(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(k): _plain(v) for k, v in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if hasattr(value, "tolist"):  # numpy scalars and arrays
        return _plain(value.tolist())
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value
