"""Reading of logs of any format by the reader that matches.

An installed package adds a format with the entry point ``vdyn.readers: NAME = package.module:READER``.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.formats.json_reader import READER as JSON
from vdyn_cli.io.formats.long_table_reader import READER as LONG
from vdyn_cli.io.formats.lvm_reader import READER as LVM
from vdyn_cli.io.formats.mat_reader import READER as MAT
from vdyn_cli.io.formats.mdf_reader import READER as MDF
from vdyn_cli.io.formats.parquet_reader import READER as PARQUET
from vdyn_cli.io.formats.tdms_reader import READER as TDMS
from vdyn_cli.io.formats.vbo_reader import READER as VBO
from vdyn_cli.io.plugins import plugins
from vdyn_cli.io.quality.log_checks import checked
from vdyn_cli.io.reader import Column, Reader, ReadOptions
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.quantities.input_file import open_regular
from vdyn_cli.quantities.log import Log

GROUP = "vdyn.readers"
# CSV is not listed: it reads every file that no other reader matches.
BUILT_IN: tuple[Reader, ...] = (MDF, PARQUET, MAT, LVM, TDMS, VBO, JSON, LONG)


def readers() -> tuple[tuple[Reader, ...], tuple[Finding, ...]]:
    """All readers, those of installed packages first and CSV last, and the errors of plug-ins that cannot be used."""
    found: list[Reader] = []
    refused: list[Finding] = []
    for plugin in plugins(GROUP).values():
        try:
            # mypy does not accept a protocol as a type argument, although isinstance does.
            found.append(plugin.load(Reader))  # type: ignore[type-abstract]
        except InputError as error:
            refused += error.findings
    return (*found, *BUILT_IN, CSV), tuple(refused)


def refuse_pipes(path: Path) -> None:
    """Refuse a path that is neither a regular file nor a folder, on which a reader could wait forever.

    Raises
    ------
    InputError : the path is a named pipe, a device or a socket.
    """
    try:
        if path.exists() and not path.is_dir():
            open_regular(path).close()
    except PermissionError:
        return  # each reader reports it
    except (OSError, ValueError) as error:
        raise InputError(Finding(str(path), f"cannot be read: {getattr(error, 'strerror', None) or error}")) from None


def _named(finding: Finding, path: Path, name: str) -> Finding:
    """The finding with the name of the log instead of its path, as the findings on its content have it."""
    return replace(
        finding, where=finding.where.replace(str(path), name), remedy=finding.remedy.replace(str(path), name)
    )


def read_log(
    path: Path, mapping: Mapping[str, Column], options: ReadOptions | None = None, name: str | None = None
) -> Log:
    """Read the mapped channels of a log of any format, in SI, with a finding for everything doubtful.

    Parameters
    ----------
    mapping : the column of each channel, ``time`` included.
    options : format of the file where it is not to be guessed.
    name : name of the log in all findings; None: the file's name.

    Raises
    ------
    InputError : with all problems of the file. A file that no reader matches is read as text, so that the message
        states its type.
    """
    refuse_pipes(path)
    known, refused = readers()
    reader = next((r for r in known if r.matches(path)), known[-1])
    try:
        options = options or ReadOptions()
        log = reader.read(path, mapping, options, name or path.name)
        return checked(log, mapping, options.split_times is not None, options.window)
    except InputError as error:
        raise InputError(*(_named(f, path, name or path.name) for f in error.findings), *refused) from None
