"""Reading of files with the fingerprint of exactly the bytes that were read."""

from __future__ import annotations

import os
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TypeVar

from vdyn_cli.io.files import sha256
from vdyn_cli.quantities.errors import Finding, InputError

T = TypeVar("T")

RECENT = 2.0  # s: time stamps of file systems have steps of up to 2 s (FAT), so that a change may not alter them


def read_unchanged(
    read: Callable[[], tuple[T, Sequence[Path]]], files: Sequence[Path] | None = None
) -> tuple[T, dict[Path, str]]:
    """The value of ``read()``, and the sha256 of each file that it read.

    Files whose device, inode, size and times are the same before and after were not changed; their fingerprints are
    computed once. If that is not certain, everything is read again between two computations of the fingerprints.

    Parameters
    ----------
    read : returns a value and the files that it read. files : these files, if they are known beforehand.

    Raises
    ------
    InputError : from ``read``, or because a file changed while it was read.
    """
    start = time.time()
    before = None if files is None else [_identity(file) for file in files]
    value, used = read()
    digests = {file: sha256(file) for file in used}
    if files is not None and before == [_identity(file) for file in files] and not _recent(files, start):
        return value, digests
    value, used = read()
    for file, digest in {file: sha256(file) for file in used}.items():
        if digests.get(file) != digest:
            remedy = "run again when the file is complete"
            raise InputError(Finding(str(file), "changed while it was being read", remedy=remedy))
    return value, digests


def _identity(file: Path) -> tuple[int, ...]:
    try:
        stat = os.stat(file)
    except (OSError, ValueError):
        return ()
    return stat.st_dev, stat.st_ino, stat.st_size, stat.st_mtime_ns, stat.st_ctime_ns


def _recent(files: Sequence[Path], start: float) -> bool:
    """Whether a file is missing, or changed so recently that a later change may not show in its times."""
    return any(not found or found[4] > 1e9 * (start - RECENT) for found in map(_identity, files))
