"""Output of documents to stdout in UTF-8."""

from __future__ import annotations

import errno
import sys

from vdyn_cli.quantities.errors import Finding, InputError


def write_out(text: str) -> None:
    """Write to stdout in UTF-8, whatever the terminal's encoding.

    Raises
    ------
    InputError : stdout is closed or full. BrokenPipeError : the reading process has ended.
    """
    try:
        if sys.stdout is None:
            raise OSError(errno.EBADF, "it is closed")
        sys.stdout.buffer.write(text.encode("utf-8"))
        sys.stdout.flush()
    except BrokenPipeError:
        raise
    except (OSError, ValueError) as error:
        why = getattr(error, "strerror", None) or str(error)
        raise InputError(Finding("stdout", f"cannot be written: {why}", remedy="write into a folder with -o")) from None
