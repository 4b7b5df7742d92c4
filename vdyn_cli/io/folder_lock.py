"""Locks that allow one writer at a time in a folder of results; the system releases them when their process ends."""

from __future__ import annotations

import contextlib
import errno
import os
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from vdyn_cli.io.files import not_written
from vdyn_cli.quantities.errors import Finding, InputError


@contextmanager
def pipeline_lock(folder: Path) -> Iterator[None]:
    """Lock a folder for one pipeline.

    Raises
    ------
    InputError : another pipeline or a step writes there, or the folder cannot be created.
    """
    with _opened(folder) as number:
        if not _try(number, shared=False):
            raise InputError(_busy(folder))
        yield


@contextmanager
def step_lock(folder: Path, own: Path) -> Iterator[None]:
    """Lock a folder for the results of one step; steps wait for each other.

    Parameters
    ----------
    own : a folder within it, whose lock serializes the steps.

    Raises
    ------
    InputError : a pipeline writes there, or the folder cannot be created.
    """
    with _opened(folder) as number, _opened(own) as turn:
        if not _try(number, shared=True):
            raise InputError(_busy(folder))
        _wait(turn)
        yield


def refuse_busy(folder: Path) -> None:
    """Refuse a folder to which a pipeline writes, before work that would be lost.

    Raises
    ------
    InputError : a pipeline writes there.
    """
    if folder.is_dir():
        with _opened(folder) as number:
            if not _try(number, shared=True):
                raise InputError(_busy(folder))


def _busy(folder: Path) -> Finding:
    remedy = "wait until it is done, or choose another folder with -o"
    return Finding(str(folder), "another run of vdyn writes its results here", remedy=remedy)


# Windows has no flock; there, and on network drives without locks, two runs in one folder are not detected.
@contextmanager
def _opened(folder: Path) -> Iterator[int]:
    try:
        folder.mkdir(parents=True, exist_ok=True)
        number = -1 if sys.platform == "win32" else os.open(folder, os.O_RDONLY)
    except (OSError, ValueError) as error:
        raise InputError(not_written(folder, error)) from None
    try:
        yield number
    finally:
        if number >= 0:
            os.close(number)


def _try(number: int, shared: bool) -> bool:
    if sys.platform == "win32":
        return True
    import fcntl

    try:
        fcntl.flock(number, (fcntl.LOCK_SH if shared else fcntl.LOCK_EX) | fcntl.LOCK_NB)
    except OSError as error:
        return error.errno not in (errno.EWOULDBLOCK, errno.EAGAIN, errno.EACCES)
    return True


def _wait(number: int) -> None:
    if sys.platform != "win32":
        import fcntl

        with contextlib.suppress(OSError):
            fcntl.flock(number, fcntl.LOCK_EX)
