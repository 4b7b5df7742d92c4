"""A parameter set in the shapes that other programs read; each format makes its files from the same `Given`."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from importlib import import_module
from typing import Literal

from vdyn_cli.export.given import Given
from vdyn_cli.quantities.errors import Finding, InputError, did_you_mean

Driven = Literal["front", "rear", "both"]

# What each format is, in words; its file has a function `made`.
FORMATS: Mapping[str, str] = {
    "c": "the full vehicle as C99: header, source and a worked example",
    "fmu": "the full vehicle for co-simulation (FMI 2.0), source inside",
    "tir": "the tire as a property file of the magic formula",
    "abc": "the road load as A, B, C and F0, F1, F2",
    "mat": "every parameter as a MATLAB struct",
}


@dataclass(frozen=True)
class Options:
    """What the command line says: a name for files and structs, and the driven axle."""

    name: str = "vehicle"
    driven: Driven = "front"


@dataclass(frozen=True)
class Made:
    """Files under their names, and what there is to say of them."""

    files: Mapping[str, bytes]
    notes: tuple[str, ...] = ()


def make(given: Given, form: str, options: Options) -> Made:
    """The files of one format.

    Raises
    ------
    InputError : no such format; parameters that it needs and nobody gave.
    """
    if form not in FORMATS:
        remedy = did_you_mean(form, FORMATS, f"there are {', '.join(FORMATS)}")
        raise InputError(Finding("--to", "is no format of vdyn export", repr(form), remedy))
    made: Callable[[Given, Options], Made] = import_module(f"vdyn_cli.export.{form}").made
    return made(given, options)
