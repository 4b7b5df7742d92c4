"""Text logs read by the CSV reader, whatever their bytes and names."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from vdyn_cli.io.csv.csv_reader import CSV
from vdyn_cli.io.quality.log_checks import checked
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.log import Log


def read_csv(path: Path, columns: Mapping[str, Column], options: ReadOptions | None = None) -> Log:
    """The mapped columns, SI, with the checks of every log."""
    return checked(CSV.read(path, columns, options or ReadOptions(), path.name), columns)
