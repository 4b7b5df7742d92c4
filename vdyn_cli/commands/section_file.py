"""The section that a step has on the pipeline's page, kept beside its JSON for pipelines that reuse the step.

A section holds figures and tables that the JSON does not. Its first line names the JSON that it belongs to.
"""

from __future__ import annotations

from pathlib import Path

from vdyn_cli.io.files import sha256, write_whole

FOLDER = ".sections"


def write_section(folder: Path, name: str, section: str) -> None:
    """Keep the section of a step whose JSON stands in the folder."""
    write_whole(_path(folder, name), f"{_first_line(folder, name)}\n{section}")


def read_section(folder: Path, name: str) -> str | None:
    """The section that belongs to the step's JSON in the folder; None where there is none.

    Raises
    ------
    OSError : the JSON cannot be read.
    """
    path = _path(folder, name)
    if not path.is_file():
        return None
    first, _, section = path.read_bytes().decode("utf-8").partition("\n")
    return section if first == _first_line(folder, name) else None


def discard_section(folder: Path, name: str) -> None:
    """Remove the section of a step that has failed, so that its earlier result is not reused with a failure page."""
    _path(folder, name).unlink(missing_ok=True)


def _path(folder: Path, name: str) -> Path:
    return folder / FOLDER / f"{name}.html"


def _first_line(folder: Path, name: str) -> str:
    return f"<!-- of the JSON with sha256 {sha256(folder / f'{name}.json')} -->"
