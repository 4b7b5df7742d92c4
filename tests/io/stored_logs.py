"""Writes columns of numbers as MDF 4, Parquet, MATLAB, LabVIEW and TDMS files, if possible with other libraries than
the program's readers use."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

Array = NDArray[np.float64]
Table = Mapping[str, Array]  # of one clock; the first column is the time in s
FORMATS = ("mf4", "parquet", "mat", "mat73", "lvm", "tdms")


def write(kind: str, path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> Path:
    """Write tables, each with its own clock, in a format; only one table for Parquet.

    Skips the test if the library that writes the format is not installed.
    """
    path = path.with_suffix({"mat73": ".mat"}.get(kind, f".{kind}"))
    writers = {"mf4": _mf4, "parquet": _parquet, "mat": _mat, "mat73": _mat73, "lvm": _lvm, "tdms": _tdms}
    writers[kind](path, tables, units)
    return path


def clean(name: str) -> str:
    """A column's name as MATLAB allows it."""
    return "".join(c if c.isalnum() else "_" for c in name)


def _library(name: str, extra: str):  # type: ignore[no-untyped-def]
    return pytest.importorskip(name, reason=f"{name} is not installed: pip install 'vdyn_cli[{extra}]'")


def _mf4(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    asammdf = _library("asammdf", "mdf")
    file = asammdf.MDF(version="4.10")
    for number, table in enumerate(tables):
        (_, time), *channels = table.items()
        signals = [asammdf.Signal(v, time, unit=units.get(n, ""), name=n) for n, v in channels]
        file.append(signals, acq_name=f"logger {number + 1}")
    file.save(path, overwrite=True)
    file.close()


def _parquet(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    pa = _library("pyarrow", "parquet")
    from pyarrow import parquet

    (table,) = tables
    fields = [pa.field(n, pa.float64(), metadata={"unit": units.get(n, "")}) for n in table]
    parquet.write_table(pa.Table.from_arrays([pa.array(v) for v in table.values()], schema=pa.schema(fields)), path)


def _mat(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    from scipy.io import savemat

    plain = [{clean(n): v for n, v in table.items()} for table in tables]
    savemat(path, plain[0] if len(plain) == 1 else {f"logger_{i + 1}": t for i, t in enumerate(plain)})


def _mat73(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    h5py = _library("h5py", "mat")
    with h5py.File(path, "w", userblock_size=512) as file:
        for number, table in enumerate(tables):
            group = file.create_group(f"logger_{number + 1}") if len(tables) > 1 else file
            for name, values in table.items():
                data = group.create_dataset(clean(name), data=values[None, :])  # a column vector, as MATLAB stores it
                data.attrs["MATLAB_class"] = np.bytes_("double")
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file".ljust(124) + b"\x00\x02IM")


def _lvm(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    multi = len(tables) > 1
    general = ["LabVIEW Measurement\t", "Writer_Version\t2", "Reader_Version\t2", "Separator\tTab"]
    general += ["Decimal_Separator\t.", "Multi_Headings\tYes", f"X_Columns\t{'Multi' if multi else 'One'}"]
    general += ["Time_Pref\tRelative", "Date\t2026/05/04", "Time\t09:30:00.5", "***End_of_Header***\t", "\t"]
    channels = [(n, next(iter(table.values())), v) for table in tables for n, v in list(table.items())[1:]]
    header = [f"Channels\t{len(channels)}", "Samples\t" + "\t".join(str(v.size) for _, _, v in channels)]
    header += ["Y_Unit_Label\t" + "\t".join(units.get(n, "") for n, _, _ in channels)]
    header += ["X0\t" + "\t".join("0.0" for _ in channels), "***End_of_Header***\t"]
    longest = max(v.size for _, _, v in channels)
    lines = ["X_Value\t" + "\t".join(("X_Value\t" if multi and i else "") + n for i, (n, _, _) in enumerate(channels))]
    lines[0] += "\tComment"

    def cell(values: Array, row: int) -> str:
        return repr(float(values[row])) if row < values.size and np.isfinite(values[row]) else ""

    for row in range(longest):
        cells = [x for n, t, v in channels for x in (cell(t, row), cell(v, row))]
        cells = cells if multi else [cells[0], *cells[1::2]]
        lines.append("\t".join(cells))
    path.write_text("\r\n".join([*general, *header, *lines]) + "\r\n")


def _tdms(path: Path, tables: Sequence[Table], units: Mapping[str, str]) -> None:
    nptdms = _library("nptdms", "tdms")
    objects = []
    for number, table in enumerate(tables):
        for name, values in table.items():
            unit = {"unit_string": units[name]} if name in units else {}
            objects.append(nptdms.ChannelObject(f"logger {number + 1}", name, values, unit))
    with nptdms.TdmsWriter(path) as file:
        file.write_segment(objects)
