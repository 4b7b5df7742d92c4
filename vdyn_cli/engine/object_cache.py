"""Cache of compiled machine code between processes, in a folder of the user.

A file holds the object code of one text, compiled by one version of LLVM for one processor: its name is the sha256 of
all of these, and its first bytes are the sha256 of the rest. A file that is missing, truncated, altered or writable by
other users is not read, and a folder that cannot be written is not used: the text is compiled instead.
"""

from __future__ import annotations

import hashlib
import os
import stat
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from threading import get_ident

VARIABLE = "VDYN_CACHE"  # the folder; empty for none
# Files of some 10 kB. A diagnosis of bumps needs 400, and the next diagnosis of that step reuses them; this is enough
# for all steps. Above this number, the least recently used quarter is removed.
MOST_FILES = 4000
DIGEST = 32  # bytes of a sha256


def folder() -> Path | None:
    """The cache folder; None where the user has disabled the cache or has no home."""
    named = os.environ.get(VARIABLE)
    if named is not None:
        return Path(named) if named else None
    base = os.environ.get("XDG_CACHE_HOME")
    try:
        return Path(base) / "vdyn" if base and Path(base).is_absolute() else Path.home() / ".cache" / "vdyn"
    except RuntimeError:
        return None


def cached(parts: tuple[str, ...], make: Callable[[], bytes]) -> bytes:
    """The object code for these parts, from the cache, or compiled and stored there.

    Parameters
    ----------
    parts : everything that the code depends on. make : compiles it.
    """
    key = hashlib.sha256("\0".join(parts).encode("utf-8")).hexdigest()
    there = folder()
    path = None if there is None else there / f"{key}.o"
    code = None if path is None else _read(path)
    if code is None:
        code = make()
        if path is not None:
            with suppress(OSError):
                _write(path, code)
    return code


def _read(path: Path) -> bytes | None:
    """The code in a file; None if it is incomplete or another user could have written it."""
    try:
        if not (_own(path.parent) and _own(path)):
            return None
        content = path.read_bytes()
        if hashlib.sha256(content[DIGEST:]).digest() != content[:DIGEST]:
            return None
        with suppress(OSError):
            os.utime(path)
        return content[DIGEST:]
    except OSError:
        return None


def _own(path: Path) -> bool:
    """Whether a file or folder belongs to this user and only this user can write it."""
    if not hasattr(os, "getuid"):
        return True
    found = path.lstat()
    others = found.st_mode & (stat.S_IWGRP | stat.S_IWOTH)
    return found.st_uid == os.getuid() and not others and not stat.S_ISLNK(found.st_mode)


def _write(path: Path, code: bytes) -> None:
    """Write a file atomically, and remove the least recently used ones if there are too many."""
    path.parent.mkdir(mode=0o700, parents=True, exist_ok=True)
    if not _own(path.parent):
        return
    partial = path.with_name(f"{path.name}.{os.getpid()}.{get_ident()}.part")
    try:
        descriptor = os.open(partial, os.O_WRONLY | os.O_CREAT | os.O_EXCL, 0o600)
        with os.fdopen(descriptor, "wb") as file:
            file.write(hashlib.sha256(code).digest() + code)
        partial.replace(path)
    finally:
        partial.unlink(missing_ok=True)
    names = [name for name in os.listdir(path.parent) if name.endswith(".o")]
    if len(names) > MOST_FILES:
        files = sorted((path.parent / name for name in names), key=lambda f: f.stat().st_mtime)
        for old in files[: len(files) - MOST_FILES + MOST_FILES // 4]:
            old.unlink(missing_ok=True)
