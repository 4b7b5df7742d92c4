"""A step's result with its provenance, to and from the JSON that other steps, scripts and people read."""

from __future__ import annotations

import json
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from functools import cache, cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.cut_ledger import DataQuality
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import Finding, merge_similar
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import FORMAT, to_document
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.quantities.result_schema import ResultDocument


@dataclass(frozen=True)
class Provenance:
    """What a result was made from.

    Parameters
    ----------
    inputs : sha256 of every input file, under its name.
    settings : the resolved description in SI units, None for a whole pipeline.
    versions : of the packages that can change a number.
    command : the command that makes the result again.
    """

    inputs: Mapping[str, str]
    settings: Mapping[str, Any] | None
    versions: Mapping[str, str]
    command: str

    def to_json(self) -> dict[str, Any]:
        """The ``provenance`` part of a JSON document."""
        return {name: value for name, value in vars(self).items() if value is not None}


@dataclass(frozen=True)
class StepRecord:
    """A step's result with its provenance: what its JSON is written from, and what the JSON is read into.

    A record that was read has no figures, comparisons, tables and methods, since the JSON does not hold them; all else
    is as it was when the step ran.
    """

    result: Result
    provenance: Provenance

    @property
    def title(self) -> str:
        """The title of the test's description, empty where it has none."""
        return str((self.provenance.settings or {}).get("title", ""))

    @property
    def to_read(self) -> tuple[Finding, ...]:
        """The warnings and findings that a reader should see before using the result."""
        warnings = [Finding(self.result.step, text) for text in self.result.fit.warnings]
        return (*warnings, *(f for f in merge_similar(self.result.findings) if not (f.minor or f.doubt)))

    @cached_property
    def document(self) -> dict[str, Any]:
        """The content of the JSON; nothing in it depends on when or where it was made."""
        result, fit = self.result, self.result.fit
        return {
            "format": FORMAT,
            "step": result.step,
            "sentence": result.sentence,
            "refused": [asdict(f) for f in result.refused],
            "withheld": dict(result.withheld),
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
            "quality": {**result.quality.to_json(), **result.extra.get("quality", {})},
            **_effects(result),
            "diagnosis": result.diagnosis and result.diagnosis.model_dump(),
            "provenance": self.provenance.to_json(),
        }


def provenance_of(inputs: Inputs, command: str, known_files: Sequence[Path]) -> Provenance:
    """The provenance of a step's result.

    Parameters
    ----------
    command : as ``step_command`` writes it.
    known_files : the parameter files among the inputs, listed under their bare names.
    """
    files = fingerprints(inputs.files, inputs.source.path.parent, known_files)
    return Provenance(files, inputs.spec.model_dump(mode="json", exclude_none=True), versions(), command)


def read_record(path: Path) -> tuple[StepRecord, str]:
    """Read a step's JSON back into a record, and the sha256 of the JSON.

    Raises
    ------
    InputError : no parameter file, or that of a refused result. OSError, ValueError, KeyError, TypeError : another
        version wrote it.
    """
    read = read_document(path)
    document, parameters = read.content, read.parameters
    ResultDocument.model_validate(document)
    fit, made = document["fit"], document["provenance"]
    diagnosis: Any = document["diagnosis"] and Diagnosis.model_validate(document["diagnosis"])
    summary = FitSummary(
        tuple(fit["runs"]),
        _number(fit["rms"]),
        _number(fit["noise_floor"]),
        str(fit["unit"]),
        tuple(fit["unknowns"]),
        str(fit["interval_unit"]),
        int(fit["interval_units"]),
        fit["held_out_rms"],
        tuple(fit["warnings"]),
    )
    findings = tuple(Finding(**f) for f in document["findings"])
    result = Result(
        str(document["step"]),
        str(document["sentence"]),
        parameters,
        summary,
        "",
        findings=findings,
        diagnosis=diagnosis,
        withheld=document["withheld"],
        quality=DataQuality.from_json(document["quality"]) if "quality" in document else DataQuality(),
    )
    provenance = Provenance(made["inputs"], made["settings"], made["versions"], str(made["command"]))
    return StepRecord(result, provenance), read.digest


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def _effects(result: Result) -> dict[str, Any]:
    """Amplitudes of the effects that the model was extended by, under ``effects``; nothing where there are none."""
    found = {
        n: {"value": e.value, "std": e.std, "interval95": list(e.interval95)} for n, e in result.amplitudes.items()
    }
    return {"effects": found} if found else {}


def fingerprints(files: Mapping[Path, str], folder: Path, known_files: Sequence[Path]) -> dict[str, str]:
    """sha256 of every input, under its path from the description's folder; parameter files under their bare name.

    Parameters
    ----------
    files : every input, with the sha256 of the bytes that were read.
    """
    names = Counter(file.name for file in known_files)
    bare = {file for file in known_files if names[file.name] == 1}
    return {file.name if file in bare else os.path.relpath(file, folder): digest for file, digest in files.items()}


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
    """Readable JSON text. Numbers that are not finite become null, as JSON has none; lone surrogates become escapes, as
    UTF-8 has none: file names in another encoding hold them."""
    text = json.dumps(_plain(document), indent=2, ensure_ascii=False, allow_nan=False) + "\n"
    return text.encode("utf-8", "backslashreplace").decode("utf-8")


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
