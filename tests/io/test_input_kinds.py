"""Inputs that never end: pipes, devices, archives that unpack to far more than a log, lines without a value."""

from __future__ import annotations

import gzip
import os
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.io.files import sha256
from vdyn_cli.io.formats.log_formats import read_log
from vdyn_cli.io.picture import read_gray
from vdyn_cli.io.reader import Column
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.parameter_json import read_document

COLUMNS = {"time": Column("t", "s", "s"), "speed": Column("v", "m/s", "m/s")}


def read(path: Path) -> object:
    return read_log(path, COLUMNS)


@pytest.mark.parametrize("reader", [read, load_yaml, read_gray, sha256, read_document])
def test_a_pipe_is_refused_by_every_reader(reader: Callable[[Path], object], tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    os.mkfifo(path)
    with pytest.raises(InputError, match="named pipe"):
        reader(path)


@pytest.mark.skipif(not os.path.exists("/dev/zero"), reason="no /dev/zero here")
@pytest.mark.parametrize("reader", [read, load_yaml, read_gray, sha256, read_document])
def test_a_device_is_refused_by_every_reader(reader: Callable[[Path], object], tmp_path: Path) -> None:
    (tmp_path / "x").symlink_to("/dev/zero")
    with pytest.raises(InputError, match="device"):
        reader(tmp_path / "x")


@pytest.mark.parametrize("reader", [read, load_yaml, read_gray, sha256, read_document])
@pytest.mark.parametrize("name", ["a\0b", "loop", "folder", "missing", "x" * 5000])
def test_what_cannot_be_opened_is_an_input_error(reader: Callable[[Path], object], name: str, tmp_path: Path) -> None:
    (tmp_path / "loop").symlink_to(tmp_path / "loop")
    (tmp_path / "folder").mkdir()
    with pytest.raises(InputError):
        reader(tmp_path / name)


def test_an_archive_of_nothing_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv.gz"
    with gzip.open(path, "wb", compresslevel=9) as file:
        file.write(b"t,v\n0,1\n1,2\n")
        for _ in range(100):
            file.write(b"\n" * (1 << 20))
    start = time.process_time()
    with pytest.raises(InputError, match="unpacks to more than 250 times its size"):
        read(path)
    assert time.process_time() - start < 10.0


def test_an_archive_of_a_log_is_read(tmp_path: Path) -> None:
    path = tmp_path / "log.csv.gz"
    path.write_bytes(gzip.compress(b"t,v\n" + b"".join(b"%d,%d\n" % (i, i % 7) for i in range(1000))))
    assert read_log(path, COLUMNS).time.size == 1000


def test_blank_lines_cost_no_rows(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    rows = b"".join(b"%d,%d\n" % (i, i % 7) for i in range(1000))
    blank = b" \n" * (1 << 22)
    path.write_bytes(b"t,v\n" + rows + blank + b"2000,x\n2001,4\n")
    with pytest.raises(InputError, match=f"log.csv:{1002 + (1 << 22)}: text among the numbers"):
        read(path)
