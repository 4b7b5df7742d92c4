"""`vdyn export`: read a parameter file and write the files of one format, all or none."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_args

from vdyn_cli.commands.console import Tell
from vdyn_cli.export import Differential, Driven, ExportOptions, make
from vdyn_cli.export.parameter_file import read_parameter_file
from vdyn_cli.io.files import write_whole
from vdyn_cli.quantities.errors import Finding, InputError


# Seven parameters: the options of the command line
def run_export(
    path: Path, form: str, folder: Path, name: str, driven: str, tell: Tell, differential: str = "open"
) -> None:
    """Write the files of one format into ``folder``, after all of them are computed.

    Parameters
    ----------
    form : a key of ``FORMATS``. name, driven, differential : as in ``ExportOptions``. tell : prints a line.

    Raises
    ------
    InputError : not a parameter file, no such format, missing parameters, or a name that is not an identifier.
    """
    # The name is an identifier in C, in MATLAB and in an FMU.
    if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]{0,30}", name):
        what = "must be a letter followed by at most 30 letters, digits or underscores"
        raise InputError(Finding("--name", what, name, "choose such a name, as in 'vehicle_1'"))
    axle = next((way for way in get_args(Driven) if way == driven), None)
    if axle is None:
        raise InputError(Finding("--driven", "is unknown", repr(driven), f"write {' or '.join(get_args(Driven))}"))
    kind = next((kind for kind in get_args(Differential) if kind == differential), None)
    if kind is None:
        remedy = f"write {' or '.join(get_args(Differential))}"
        raise InputError(Finding("--differential", "is unknown", repr(differential), remedy))
    made = make(read_parameter_file(path), form, ExportOptions(name, axle, kind))
    for file, data in made.files.items():
        write_whole(folder / file, data)
        tell(str(folder / file))
    for note in made.notes:
        tell(f"  {note}")
