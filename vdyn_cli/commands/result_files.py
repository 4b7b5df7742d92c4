"""The files of a step's result: JSON, page, and the section for the pipeline's page, which belong together.

The section contains figures and tables that the JSON does not have, for pipelines that reuse the step. Its first line
states the sha256 of all three, so that an edited or mixed result is detected and computed again.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from vdyn_cli.io.files import digest_of, remove_temporaries, sha256, write_together, write_whole
from vdyn_cli.io.folder_lock import step_lock

FOLDER = ".sections"


def write_results(folder: Path, name: str, document: str, page: str, section: str) -> None:
    """Write JSON, section and page of a step together, so that none is ever next to those of another result.

    Assumes that the caller has locked the folder (``section_lock``, or the lock of a pipeline).

    Raises
    ------
    InputError : the folder cannot be written.
    """
    first = _first_line(digest_of(document), digest_of(page), digest_of(section))
    write_together(
        {
            folder / f"{name}.json": document,
            _path(folder, name): f"{first}\n{section}",
            folder / f"{name}.html": page,
        }
    )


def write_document(folder: Path, name: str, document: str) -> None:
    """Write the JSON of a step before its page, and remove the page and the section of an earlier result.

    Steps that read the JSON can start while the page is drawn. Assumes that the caller has locked the folder.

    Raises
    ------
    InputError : the folder cannot be written.
    """
    for old in (folder / f"{name}.html", _path(folder, name)):
        with suppress(OSError):
            old.unlink()
    write_whole(folder / f"{name}.json", document)


@contextmanager
def section_lock(folder: Path) -> Iterator[None]:
    """Context that locks the folder for the results of one step.

    Raises
    ------
    InputError : a pipeline writes there, or the folder cannot be created.
    """
    with step_lock(folder, folder / FOLDER):
        yield


def remove_leftovers(folder: Path) -> None:
    """Remove temporary files of killed processes from a folder that the caller has locked."""
    remove_temporaries(folder)
    remove_temporaries(folder / FOLDER)


def read_section(folder: Path, name: str) -> str | None:
    """The section of the step's result in the folder; None if JSON, page and section were not written together.

    Raises
    ------
    InputError : the JSON or the page cannot be read. OSError, ValueError : the section cannot be read.
    """
    path = _path(folder, name)
    if not path.is_file():
        return None
    first, _, section = path.read_bytes().decode("utf-8").partition("\n")
    own = sha256(folder / f"{name}.json"), sha256(folder / f"{name}.html"), digest_of(section)
    return section if first == _first_line(*own) else None


def _path(folder: Path, name: str) -> Path:
    return folder / FOLDER / f"{name}.html"


def _first_line(document: str, page: str, section: str) -> str:
    return f"<!-- sha256 of the JSON {document}, the page {page}, this section {section} -->"
