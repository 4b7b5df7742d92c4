"""Export of a parameter set to the formats of other programs, each from the same `ParameterFile`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from vdyn_cli.export.parameter_file import ParameterFile
from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean

Driven = Literal["front", "rear", "both"]
Differential = Literal["open", "locked"]

# What each format is; its module has a function `made`.
FORMATS: Mapping[str, str] = {
    "c": "the full vehicle as C99: header, source and a worked example",
    "fmu": "the full vehicle for co-simulation (FMI 2.0), source inside",
    "tir": "the tire as a property file of the magic formula",
    "abc": "the road load as A, B, C and F0, F1, F2",
    "fastsim": "the body of a FASTSim 3.1 vehicle file",
    "wltp": "road load, mass and radius for wltp 1.1 and CO2MPAS 4.1 to 4.3",
    "mat": "every parameter as a MATLAB struct",
}


@dataclass(frozen=True)
class ExportOptions:
    """Options of the command line: name of files and structs, driven axle, and its differential."""

    name: str = "vehicle"
    driven: Driven = "front"
    differential: Differential = "open"


@dataclass(frozen=True)
class ExportedFiles:
    """Content of each file by its name, and notes for the console."""

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()


def make(parameter_file: ParameterFile, form: str, options: ExportOptions) -> ExportedFiles:
    """The files of one format.

    Parameters
    ----------
    form : a key of FORMATS. options : name, driven axle, differential.

    Raises
    ------
    InputError : no such format; parameters that it needs are missing; a value that the receiver refuses.
    """
    if form not in FORMATS:
        remedy = did_you_mean(form, FORMATS, f"there are {', '.join(FORMATS)}")
        raise InputError(Finding("--to", "is not a format of vdyn export", repr(form), remedy))
    made: Callable[[ParameterFile, ExportOptions], ExportedFiles] = import_module(f"vdyn_cli.export.{form}").made
    return made(parameter_file, options)
