"""A step's result with its provenance, and its conversion to and from JSON."""

from __future__ import annotations

import hashlib
import json
import math
import os
from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache, cached_property
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Any

import vdyn_cli
from vdyn_cli.diagnosis.policy import POLICY
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.quantities.data_quality import DataQuality
from vdyn_cli.quantities.diagnosis import Diagnosis
from vdyn_cli.quantities.errors import BEFORE_REMEDY, Finding, merge_similar
from vdyn_cli.quantities.parameter_json import read_document
from vdyn_cli.quantities.parameters import FORMAT, to_document
from vdyn_cli.quantities.result import FitSummary, Result
from vdyn_cli.quantities.result_schema import FitEntry, ResultDocument

SOURCES = {".py", ".html", ".css"}  # suffixes of the program's files that can change a result or its page


@dataclass(frozen=True)
class Provenance:
    """The provenance of a result.

    Parameters
    ----------
    inputs : sha256 of every input file, by name.
    settings : the resolved description in SI units; None for a pipeline.
    versions : of the packages that can affect a number.
    command : the command that reproduces the result.
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
    """A step's result with its provenance, the content of its JSON.

    A record read from JSON lacks figures, comparisons, tables and methods, which the JSON does not contain; all else is
    as when the step ran.
    """

    result: Result
    provenance: Provenance

    @property
    def title(self) -> str:
        """The title of the test's description; empty if it has none."""
        return str((self.provenance.settings or {}).get("title", ""))

    @property
    def to_read(self) -> tuple[Finding, ...]:
        """The warnings and findings to read before the result is used."""
        texts = [text.partition(BEFORE_REMEDY) for text in self.result.fit.warnings]
        warnings = [Finding(self.result.step, what, remedy=remedy) for what, _, remedy in texts]
        return (*warnings, *(f for f in merge_similar(self.result.findings) if not (f.minor or f.doubt)))

    @cached_property
    def document(self) -> dict[str, Any]:
        """The content of the JSON; it does not depend on when or where it was written."""
        result = self.result
        return {
            "format": FORMAT,
            "step": result.step,
            "sentence": result.sentence,
            "refused": [f.to_json() for f in result.refused],
            "withheld": dict(result.withheld),
            **to_document(result.parameters),
            "fit": {**vars(result.fit)},
            "findings": [f.to_json() for f in result.findings],
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
    inputs : of the step. command : from ``step_command``.
    known_files : the parameter files among the inputs, listed by their file names without folders.
    """
    files = fingerprints(inputs.files, inputs.source.path.parent, known_files)
    return Provenance(files, inputs.spec.model_dump(mode="json", exclude_none=True), versions(), command)


def read_record(path: Path) -> tuple[StepRecord, str]:
    """Read a step's JSON back into a record, and the sha256 of the JSON.

    Raises
    ------
    InputError : the file is not a parameter file, or is that of a refused result. OSError, ValueError, KeyError,
        TypeError : it was written by another version.
    """
    read = read_document(path)
    document, parameters = read.content, read.parameters
    ResultDocument.model_validate(document)
    made = document["provenance"]
    diagnosis: Any = document["diagnosis"] and Diagnosis.model_validate(document["diagnosis"])
    findings = tuple(Finding(**f) for f in document["findings"])
    result = Result(
        str(document["step"]),
        str(document["sentence"]),
        parameters,
        FitSummary(**vars(FitEntry.model_validate(document["fit"]))),
        "",
        findings=findings,
        diagnosis=diagnosis,
        withheld=document["withheld"],
        quality=DataQuality.from_json(document["quality"]) if "quality" in document else DataQuality(),
    )
    provenance = Provenance(made["inputs"], made["settings"], made["versions"], str(made["command"]))
    return StepRecord(result, provenance), read.digest


def _effects(result: Result) -> dict[str, Any]:
    """Amplitudes of the effects that extend the model, under ``effects``; empty if there are none."""
    found = {
        n: {"value": e.value, "std": e.std, "interval95": list(e.interval95)} for n, e in result.amplitudes.items()
    }
    return {"effects": found} if found else {}


def fingerprints(files: Mapping[Path, str], folder: Path, known_files: Sequence[Path]) -> dict[str, str]:
    """sha256 of every input by its path relative to the description's folder; of parameter files by file name.

    Parameters
    ----------
    files : every input, with the sha256 of the bytes that were read. folder : of the description.
    known_files : the parameter files among them; those with equal names are listed by path.
    """
    names = Counter(file.name for file in known_files)
    bare = {file for file in known_files if names[file.name] == 1}
    return {file.name if file in bare else os.path.relpath(file, folder): digest for file, digest in files.items()}


def step_command(step: str, path: Path, known_files: Sequence[Path], level: float | None) -> str:
    """The command that reproduces a step's result, with file names without folders.

    Parameters
    ----------
    known_files : parameter files. level : false-alarm probability of the diagnosis; None: no diagnosis.
    """
    known = [f"--known {file.name}" for file in known_files]
    how = [] if level == POLICY.level else ["--no-diagnose"] if level is None else [f"--level {level:.4g}"]
    return " ".join(["vdyn", step, path.name, *known, *how])


@cache
def versions() -> dict[str, str]:
    """The versions of the packages that can affect a result, by name; vdyn's with a digest of its source."""
    found = {}
    for package in ("vdyn_cli", "numpy", "scipy", "casadi", "llvmlite"):
        try:
            found[package] = version(package)
        except PackageNotFoundError:
            found[package] = "absent"
    return {**found, "vdyn_cli": f"{found['vdyn_cli']}+{_source_digest()}"}


def _source_digest() -> str:
    """Eight hexadecimal digits of the program's source: a clone that is updated keeps its version."""
    digest, package = hashlib.sha256(), Path(vdyn_cli.__file__).parent
    for path in sorted(p for p in package.rglob("*") if p.suffix in SOURCES):
        digest.update(path.relative_to(package).as_posix().encode())
        digest.update(path.read_bytes())
    return digest.hexdigest()[:8]


def to_json(document: Mapping[str, Any]) -> str:
    """Indented JSON text. Numbers that are not finite become null; lone surrogates (file names in another encoding)
    become escapes."""
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
