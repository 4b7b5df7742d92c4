"""VBOX logs (.vbo): text in sections, with the channels' names and units above the numbers.

The time of day in UTC, ``HHMMSS.ss``, is converted to seconds since the first sample; latitude and longitude, in
minutes of arc and the latter positive to the west, are converted to degrees, positive to the east.

Format: Racelogic, "VBO file structure".
"""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from contextlib import nullcontext
from io import StringIO
from pathlib import Path

import numpy as np

from vdyn_cli.io.clocks.written_times import since_first
from vdyn_cli.io.formats.stored_channels import StoredChannel, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError

_SECTION = re.compile(r"\[([a-z ]+)\]\s*$", re.IGNORECASE)
_STANDARD = (  # unit of a standard channel, by the words of its title under [header]
    ("kmh", "km/h"),
    ("knots", "knot"),
    ("mph", "mph"),
    ("m/s", "m/s"),
    ("accel", "g"),
    ("heading", "deg"),
    ("height", "m"),
    ("latitude", "deg"),
    ("longitude", "deg"),
)
_MINUTES = {"lat": 1.0 / 60.0, "latitude": 1.0 / 60.0, "long": -1.0 / 60.0, "longitude": -1.0 / 60.0}  # to deg


class _VboTable:
    """The channels of one file, all on one clock."""

    row = "line"

    def __init__(self, names: Sequence[str], units: Sequence[str], values: Sequence[Array | None], first: int) -> None:
        self._values = [v if v is None else _converted(n, v) for n, v in zip(names, values, strict=True)]
        self._first = first
        self.listed = tuple(
            StoredChannel(name, "s", "table", i, master=True, begin=_begin(values[i]))
            if _is_time(name)
            else StoredChannel(name, unit, "table", i)
            for i, (name, unit) in enumerate(zip(names, units, strict=True))
        )

    def line(self, channel: StoredChannel, row: int) -> int:
        """The line of a row in the file."""
        return self._first + row

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The samples as parsed."""
        return [self._values[c.at] for c in wanted if isinstance(c.at, int)]


def _parsed(path: Path) -> _VboTable:
    refuse_missing(path)
    lines = path.read_bytes().decode("utf-8-sig", "replace").splitlines()
    sections = {found[1].lower(): i for i, line in enumerate(lines) if (found := _SECTION.match(line))}
    if "data" not in sections or "column names" not in sections:
        missing = "data" if "column names" in sections else "column names"
        what = f"has no section [{missing}]: the file is incomplete"
        raise InputError(Finding(path.name, what, remedy="copy it again"))
    names = " ".join(_section(lines, sections, "column names")).split()
    first = sections["data"] + 1
    values = _columns(lines[first:], len(names), f"{path.name}:{first + 1}")
    titles, stated = (_section(lines, sections, key) for key in ("header", "channel units"))
    return _VboTable(names, _units(len(names), titles, stated), values, first + 1)


def _section(lines: Sequence[str], sections: dict[str, int], name: str) -> list[str]:
    """The lines of a section, without the empty line at its end; none if the file lacks it."""
    if name not in sections:
        return []
    begin = sections[name] + 1
    stop = min((i for i in sections.values() if i >= begin), default=len(lines))
    found = [line.strip() for line in lines[begin:stop]]
    return found[:-1] if found and not found[-1] else found


def _units(count: int, titles: Sequence[str], stated: Sequence[str]) -> list[str]:
    """Units of the columns: of added channels as stated in their section, of standard channels from their titles."""
    if len(titles) != count:
        return [""] * count
    own = [next((unit for word, unit in _STANDARD if word in title.lower()), "") for title in titles]
    added = min(len(stated), count)
    return own[: count - added] + [u or o for u, o in zip(stated[-added:], own[-added:], strict=True)] if added else own


def _columns(rows: Sequence[str], count: int, where: str) -> list[Array | None]:
    """Columns of numbers; None for a column of text."""
    import pandas as pd

    try:
        table = pd.read_csv(StringIO("\n".join(rows)), sep=r"\s+", header=None, names=range(count), dtype=str)
    except (ValueError, pd.errors.ParserError) as error:
        raise InputError(Finding(where, "rows differ in length", str(error)[:80], "export it again")) from None
    columns = [pd.to_numeric(table[i], errors="coerce").to_numpy(dtype=float) for i in range(count)]
    return [c if np.isfinite(c).any() or not table[i].notna().any() else None for i, c in enumerate(columns)]


def _converted(name: str, values: Array) -> Array:
    return since_first(_of_day(values)) if _is_time(name) else values * _MINUTES.get(name.lower(), 1.0)


def _of_day(values: Array) -> Array:
    """Times written as hhmmss.ss, in s since midnight."""
    hours, rest = np.divmod(values, 10000.0)
    minutes, seconds = np.divmod(rest, 100.0)
    return np.asarray(3600.0 * hours + 60.0 * minutes + seconds)


def _begin(values: Array | None) -> float:
    """The first time of day, s; NaN if there is none."""
    written = np.empty(0) if values is None else _of_day(values[np.isfinite(values)])
    return float(written[0]) if written.size else math.nan


def _is_time(name: str) -> bool:
    return name.lower() == "time"


READER = StoredReader(
    lambda head, path: path.suffix.lower() == ".vbo" or head.lstrip(b"\xef\xbb\xbf").startswith(b"File created on"),
    lambda path: nullcontext(_parsed(path)),
)
