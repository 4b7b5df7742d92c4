"""Tables of texts for a page."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from vdyn_cli.quantities.arrays import rms
from vdyn_cli.quantities.result import Table
from vdyn_cli.report import typography
from vdyn_cli.report.panels import ChannelTraces, judged_residual


@dataclass(frozen=True)
class TextTable:
    """A table of texts; ``numeric`` marks the columns that are right-aligned."""

    title: str
    caption: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]
    numeric: tuple[bool, ...]


_NUMERIC = re.compile(r"[+\-−±<>≈]?\s*[\d.,\s  ]*\d[\d.,\s  ]*(?:%|e[+-]?\d+)?(?:\s*[±×].*)?")
_BLANK = ("", "-", "–", "—", "n/a")


def text_table(table: Table) -> TextTable:
    """A step's table with rows padded to equal length; a column is numeric if most of its cells are numbers."""
    columns = tuple(typography.prose(c) for c in table.columns)
    width = max([len(columns), *(len(row) for row in table.rows)], default=0)
    columns += ("",) * (width - len(columns))
    rows = tuple(
        tuple(typography.run_name(typography.prose(c)) for c in row) + ("",) * (width - len(row)) for row in table.rows
    )
    numeric = tuple(_is_numeric([row[i] for row in rows]) for i in range(width))
    return TextTable(typography.prose(table.title), typography.prose(table.caption), columns, rows, numeric)


def _is_numeric(column: Sequence[str]) -> bool:
    filled = [c for c in column if c not in _BLANK]
    return bool(filled) and sum(bool(_NUMERIC.fullmatch(c)) for c in filled) > 0.6 * len(filled)


def run_table(channel: ChannelTraces) -> TextTable:
    """One row per run: samples in the fit, rms before and after the extension, mean and largest residual."""
    rows = []
    for one in channel.traces:
        residual = judged_residual(one)[np.isfinite(judged_residual(one))]
        error, mean = rms(residual), float(residual.mean()) if residual.size else math.nan
        rows.append(
            (
                one.run + (" (held out)" if one.held_out else ""),
                f"{int(np.count_nonzero(one.used & np.isfinite(one.residual)))} of {one.x.size}",
                typography.significant(error, 3),
                "" if one.before is None else typography.significant(rms(one.before), 3),
                "0" if abs(mean) < 1e-3 * error else typography.signed(mean, 2),
                typography.significant(float(abs(residual).max()), 2) if residual.size else typography.DASH,
            )
        )
    unit = typography.unit(channel.unit)
    columns = ("run", "samples used", "rms", "rms before the extension", "mean", "largest")
    keep = [i for i in range(6) if i != 3 or channel.extended]
    title = f"{typography.title(channel.name)}, run by run" + (f" ({unit})" if unit else "")
    return TextTable(
        title,
        "",
        tuple(columns[i] for i in keep),
        tuple(tuple(row[i] for i in keep) for row in rows),
        tuple(i > 0 for i in keep),
    )
