"""Files that appear whole or not at all, and their fingerprints."""

from __future__ import annotations

import hashlib
import os
import tempfile
from pathlib import Path

from vdyn_cli.quantities.errors import Finding, InputError


def write_whole(path: Path, content: str | bytes) -> None:
    """Write a file under a temporary name and rename it into place, so that no reader ever sees a part of it.

    Raises
    ------
    InputError : the folder can't be made or written.
    """
    data = content.encode("utf-8") if isinstance(content, str) else content
    temporary: Path | None = None
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.NamedTemporaryFile(dir=path.parent, prefix=f".{path.name}.", delete=False) as file:
            temporary = Path(file.name)
            file.write(data)
            file.flush()
            os.fsync(file.fileno())
        temporary.chmod(0o666 & ~_umask())
        temporary.replace(path)
        temporary = None
    except OSError as error:
        finding = Finding(str(path), f"can't be written: {error.strerror}", remedy="choose another folder with -o")
        raise InputError(finding) from None
    finally:
        if temporary is not None:
            temporary.unlink(missing_ok=True)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def sha256(path: Path) -> str:
    """The file's fingerprint, read in pieces.

    Raises
    ------
    InputError : the file can't be read.
    """
    digest = hashlib.sha256()
    try:
        with path.open("rb") as file:
            while piece := file.read(1 << 20):
                digest.update(piece)
    except OSError as error:
        raise InputError(Finding(str(path), f"can't be read: {error.strerror}")) from None
    return digest.hexdigest()
