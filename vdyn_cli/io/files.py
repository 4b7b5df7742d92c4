"""Atomic writing of files, and their fingerprints."""

from __future__ import annotations

import contextlib
import hashlib
import os
import tempfile
from collections import Counter
from collections.abc import Iterable, Mapping
from pathlib import Path

from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean
from vdyn_cli.quantities.input_file import open_regular, unreadable

_NO_LOGS = ("", ".yaml", ".yml", ".json", ".html")
TEMPORARY = ".vdyn-tmp"  # ending of files that are being written


def remedy_for_missing_file(
    path: Path, otherwise: str = "write its path relative to the folder of the description"
) -> str:
    """The remedy for a file that does not exist: the files of its folder with a similar name, or ``otherwise``."""
    try:
        return did_you_mean(path.name, [p.name for p in path.parent.iterdir()], otherwise)
    except (OSError, ValueError):
        return f"there is no folder {path.parent}"


def distinct_names(paths: Iterable[Path]) -> dict[Path, str]:
    """For each path its file name, with as many of its folders as distinguish it from the others."""
    every = list(dict.fromkeys(paths))
    names = {}
    for path in every:
        tails = ["/".join(path.parts[-n:]) for n in range(1, len(path.parts) + 1)] or ["."]  # "." has no parts
        alone = [t for t in tails if not any(f"/{o.as_posix()}".endswith(f"/{t}") for o in every if o != path)]
        names[path] = (alone or tails[-1:])[0]
    return names


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file under a temporary name and rename it into place, so that no reader sees an incomplete file.

    Raises
    ------
    InputError : the folder cannot be created or written to.
    """
    write_together({path: content})


def write_together(files: Mapping[Path, str | bytes]) -> None:
    """Write a main file, the first, and files that belong to it.

    All are written under temporary names before any is renamed into place. Old files with the names of the others are
    removed before the main file is renamed, so that a main file is never next to files of another run.

    Raises
    ------
    InputError : a folder cannot be created or written to.
    """
    staged: dict[Path, Path] = {}
    path = next(iter(files))
    try:
        if path.is_dir():
            raise InputError(Finding(str(path), "is a folder", remedy="name a file in it"))
        for path, content in files.items():
            _stage(path, content.encode("utf-8") if isinstance(content, str) else content, staged)
        for path in list(files)[1:]:
            path.unlink(missing_ok=True)
        for path in files:
            staged[path].replace(path)
            del staged[path]
    except (OSError, ValueError) as error:
        raise InputError(not_written(path, error)) from None
    finally:
        for temporary in staged.values():
            temporary.unlink(missing_ok=True)


def not_written(path: Path, error: OSError | ValueError) -> Finding:
    """The finding that a file, or a folder for results, cannot be written, with the reason.

    A file in place of a folder is named, as the system only says that it exists.
    """
    remedy = "choose another folder with -o"
    blocking = next((p for p in (path, *path.parents) if p.is_file()), None)
    if isinstance(error, FileExistsError | NotADirectoryError) and blocking is not None:
        return Finding(str(blocking), "is a file, not a folder", remedy=remedy)
    return Finding(str(path), f"cannot be written: {getattr(error, 'strerror', None) or error}", remedy=remedy)


def _stage(path: Path, data: bytes, staged: dict[Path, Path]) -> None:
    """Write the data to a temporary file in the same folder, and enter its path in ``staged``."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", suffix=TEMPORARY, delete=False) as file:
        staged[path] = Path(file.name)
        file.write(data)
        file.flush()
        os.fsync(file.fileno())
    staged[path].chmod(0o666 & ~_umask())


def remove_temporaries(folder: Path) -> None:
    """Remove the temporary files of processes that were killed. Assumes that no other process writes to the folder."""
    for left in folder.glob(f".*{TEMPORARY}") if folder.is_dir() else ():
        with contextlib.suppress(OSError):
            left.unlink()


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def sha256(path: Path) -> str:
    """The sha256 of a file, read in pieces.

    Raises
    ------
    InputError : the file cannot be read.
    """
    digest = hashlib.sha256()
    try:
        with open_regular(path) as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
    except OSError as error:
        raise unreadable(path, error) from None
    return digest.hexdigest()


def digest_of(content: str | bytes) -> str:
    """The sha256 of the content of a file; text is encoded in UTF-8."""
    return hashlib.sha256(content.encode("utf-8") if isinstance(content, str) else content).hexdigest()


def folder_error(path: Path, name: str = "") -> InputError:
    """The error for a folder given as a log; the remedy names one of the most frequent kind of files in it.

    ``name``: of the folder in messages, if not its path.
    """
    name = name or str(path)
    logs = sorted(p for p in path.iterdir() if p.is_file() and p.suffix not in {*_NO_LOGS, ""})
    kinds = Counter(p.suffix for p in logs)
    usual = max(logs, key=lambda p: kinds[p.suffix], default=None)
    remedy = f"name the logs in it, such as {name}/{usual.name}" if usual else "name a file in it"
    return InputError(Finding(name, "is a folder, not a log", remedy=remedy))
