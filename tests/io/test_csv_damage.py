"""Whatever happens to a file's bytes, reading gives a log or a clear message, never another error."""

from __future__ import annotations

import gzip
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.io.text_logs import read_csv
from vdyn_cli.io.reader import Column, ReadOptions
from vdyn_cli.quantities.errors import InputError

COLUMNS = {"time": Column("t", "s", "s"), "speed": Column("v [m/s]", "m/s", "m/s")}
GOOD = "t,v [m/s],note\n" + "".join(f"{i / 10:.1f},{np.sin(i):.3f},ok\n" for i in range(40))

Change = tuple[str, int, bytes]
changes = st.lists(
    st.tuples(
        st.sampled_from(["put", "insert", "delete", "cut", "repeat"]), st.integers(0, 9999), st.binary(max_size=6)
    ),
    min_size=1,
    max_size=6,
)
alphabet = "0123456789.,;\t \n\r\"'-eEtv[m/s]#abc"
anything = st.binary(max_size=300) | st.text(alphabet, max_size=200).map(str.encode)


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return tmp_path_factory.mktemp("damage") / "run.csv"


def dressed(dress: str) -> bytes:
    text = GOOD
    if dress == "units":
        text = text.replace("\n", "\ns,m/s,-\n", 1)
    if dress == "decimal comma":
        text = text.replace(",", ";").replace(".", ",")
    data = text.encode("utf-16" if dress == "utf-16" else "utf-8")
    return gzip.compress(data, mtime=0) if dress == "gzip" else data


def damaged(data: bytes, change: Change) -> bytes:
    kind, where, what = change
    at = where % (len(data) + 1)
    parts = {
        "put": (data[:at], what, data[at + len(what) :]),
        "insert": (data[:at], what, data[at:]),
        "delete": (data[:at], data[at + where % 40 :]),
        "cut": (data[:at],),
        "repeat": (data[:at], data[at // 2 :]),
    }
    return b"".join(parts[kind])


def is_read_or_refused(path: Path, data: bytes, clock: str = "strict") -> bool:
    """Whether the bytes give a log without infinite numbers, or an error whose findings state place and fact."""
    path.write_bytes(data)
    try:
        log = read_csv(path, COLUMNS, ReadOptions(clock=clock))  # type: ignore[arg-type]
    except InputError as error:
        return bool(error.findings) and all(f.where and f.what for f in error.findings)
    return log.time.size >= 2 and bool(np.isfinite(log.time).all()) and not np.isinf(log["speed"]).any()


@settings(max_examples=150, deadline=None, derandomize=True)
@given(
    changes=changes,
    dress=st.sampled_from(["plain", "gzip", "utf-16", "units", "decimal comma"]),
    clock=st.sampled_from(["strict", "drop"]),
)
def test_random_damage(path: Path, changes: list[Change], dress: str, clock: str) -> None:
    data = dressed(dress)
    for change in changes:
        data = damaged(data, change)
    assert is_read_or_refused(path, data, clock)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(data=anything)
def test_any_bytes(path: Path, data: bytes) -> None:
    assert is_read_or_refused(path, data)


@settings(max_examples=100, deadline=None, derandomize=True)
@given(data=anything)
def test_any_bytes_below_a_good_header(path: Path, data: bytes) -> None:
    assert is_read_or_refused(path, b"t,v [m/s]\n" + data)
