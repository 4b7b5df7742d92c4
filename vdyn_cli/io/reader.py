"""The contract of a reader of logs: it only parses; quality checks, units and signs are the same for all formats."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, Protocol, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import to_si

Array = NDArray[np.float64]

_CLOCK = re.compile(r"(time|t|zeit)\b", re.IGNORECASE)


@dataclass(frozen=True)
class Column:
    """Where a channel stands in a file.

    Parameters
    ----------
    column : its name in the file; ``Name#2`` is the second of several of that name.
    unit, si_unit : unit in the file, and the SI unit that the channel has inside.
    sign : -1 where the logger's convention is the opposite.
    optional : a missing or empty column is left out rather than refused.
    where : file and line of the description that requests it.
    """

    column: str
    unit: str
    si_unit: str
    sign: int = 1
    optional: bool = False
    where: str = ""

    def in_si(self, values: Array) -> Array:
        """Values (n,) of the file in SI with the sign of our convention."""
        converted = to_si(values, self.unit, self.si_unit)
        return -converted if self.sign < 0 else converted


@dataclass(frozen=True)
class ReadOptions:
    """How a log is written, where guessing is not wanted.

    Parameters
    ----------
    delimiter : ``;``, ``,``, ``|``, ``tab``, ``space`` (any run of blanks); guessed where None.
    decimal : decimal mark; guessed where None.
    encoding : such as utf-8, cp1252, utf-16; guessed where None.
    clock : ``strict`` refuses a clock that does not rise, ``drop`` leaves out the rows that do not rise.
    header_row : line of the column names, counted from 1; searched where None.
    """

    delimiter: str | None = None
    decimal: Literal[".", ","] | None = None
    encoding: str | None = None
    clock: Literal["strict", "drop"] = "strict"
    header_row: int | None = None


@dataclass(frozen=True)
class ChannelInfo:
    """A channel that a file holds.

    Parameters
    ----------
    name, unit : as the file writes them; the unit is empty where the file states none.
    rate : written samples per second, NaN where the clock is not known.
    span : first and last time at which it is written, s; NaN where the clock is not known.
    """

    name: str
    unit: str
    rate: float
    span: tuple[float, float]


def is_clock(name: str) -> bool:
    """Whether a channel's name in a file is that of a clock: it begins with the word time, t or Zeit."""
    return _CLOCK.match(name) is not None


@runtime_checkable
class Reader(Protocol):
    """A log format."""

    def matches(self, path: Path) -> bool:
        """Whether the file has this format, told from its name or its first bytes; False for a missing file."""

    def channels(self, path: Path) -> tuple[ChannelInfo, ...]:
        """The channels of a file, in its order.

        Raises
        ------
        InputError : the file cannot be read.
        """

    def read(self, path: Path, mapping: Mapping[str, Column], options: ReadOptions, name: str) -> Log:
        """The mapped channels as the file holds them: in its units and with its signs.

        Parameters
        ----------
        mapping : where each channel stands; ``time`` is among them.
        name : what the log is called in all findings.

        Returns
        -------
        Log : time in SI, each channel NaN where nothing is written, nothing interpolated or sorted; ``source`` says
            where the samples stand in the file.

        Raises
        ------
        InputError : with every problem of the file.
        """
