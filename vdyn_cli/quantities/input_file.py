"""Opening of input files; refuses pipes and devices, because reading them may never end."""

from __future__ import annotations

import errno
import os
import stat
from pathlib import Path
from typing import BinaryIO

from vdyn_cli.quantities.errors import Finding, InputError

_KINDS = {
    stat.S_IFIFO: "a named pipe",
    stat.S_IFCHR: "a device",
    stat.S_IFBLK: "a device",
    stat.S_IFSOCK: "a socket",
}


def unreadable(path: Path, error: OSError) -> InputError:
    """The message on a file that the system does not let a program read."""
    if isinstance(error, IsADirectoryError):
        return InputError(Finding(str(path), "is a folder, not a file", "", "name a file in it"))
    denied = isinstance(error, PermissionError)
    remedy = "close the program that uses the file, or check its permissions" if denied else ""
    return InputError(Finding(str(path), f"cannot be read: {error.strerror or error}", remedy=remedy))


def open_regular(path: Path) -> BinaryIO:
    """Open a regular file for reading in binary.

    Raises
    ------
    OSError : as ``open``; also, with the reason in ``strerror``, for a pipe, a device, or a path with an invalid
        character.
    """
    try:
        # Without O_NONBLOCK, opening a pipe waits for a writer.
        number = os.open(path, os.O_RDONLY | getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0))
    except ValueError:
        raise OSError(errno.EINVAL, "the path contains an invalid character") from None
    try:
        kind = stat.S_IFMT(os.fstat(number).st_mode)
        if kind == stat.S_IFDIR:
            raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR))
        if kind != stat.S_IFREG:
            raise OSError(errno.EINVAL, f"it is {_KINDS.get(kind, 'not a file')}; copy its content into a file")
        return os.fdopen(number, "rb")
    except BaseException:
        os.close(number)
        raise


def read_regular(path: Path, most: int) -> bytes:
    """The content of a regular file of at most ``most`` bytes.

    Raises
    ------
    OSError : as ``open_regular`` does; EFBIG for a larger file.
    """
    with open_regular(path) as file:
        data = file.read(most + 1)
    if len(data) > most:
        raise OSError(errno.EFBIG, f"it has more than {most} bytes")
    return data
