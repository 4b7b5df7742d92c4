"""Small blocks of plain numbers are read without pandas, to the same numbers; everything else by pandas."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.io.csv import csv_numbers
from vdyn_cli.io.csv.csv_layout import Layout
from vdyn_cli.io.csv.csv_numbers import Numbers, read_numbers

HEADER = ("t", "v", "a")


def read(text: str, delimiter: str = ",", decimal: str = ".") -> Numbers:
    layout = Layout(delimiter, decimal, HEADER, 0, (), 1, 0)
    return read_numbers([text.encode()], layout, (0, 2), "utf-8", "log.csv")


def by_pandas(monkeypatch: pytest.MonkeyPatch, *arguments: str) -> Numbers:
    with monkeypatch.context() as patch:
        patch.setattr(csv_numbers, "SMALL", 0)
        return read(*arguments)


def test_plain_numbers_are_read_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    rows = np.random.default_rng(5).normal(0.0, 1e3, (200, 3))
    text = "".join(f"{a:.6f}, {b:.4e},{c:.3f}\r\n" for a, b, c in rows)
    quick, usual = read(text), by_pandas(monkeypatch, text)
    for k in (0, 2):
        np.testing.assert_allclose(quick.columns[k], usual.columns[k], rtol=1e-15)
    assert (quick.bad, quick.lines, quick.multiline) == (usual.bad, usual.lines, usual.multiline)


@pytest.mark.parametrize(
    ("text", "delimiter", "decimal"),
    [
        ("0.1;1;2.5\n0.2;1;\n", ";", "."),
        ("0.1,1,2.5\n\n0.2,1,3.5\n", ",", "."),
        ("0.1,1,2.5\n0.2,1\n0.3,1,2,4\n", ",", "."),
        ("0.1,1,fault\n0.2,1,inf\n", ",", "."),
        ("1.000,5;1;2,5\n1.001,5;1;3\n", ";", ","),
        ("0,1;1;2,5\n0,2;1;-3e1\n", ";", ","),
        ('0.1,"1","2.5"\n0.2,1,3.5\n', ",", "."),
        ("0.1,1,2.5\n0.2,1,3.5", ",", "."),
    ],
    ids=["blank", "blank row", "ragged", "no number", "thousands", "decimal comma", "quotes", "no line end"],
)
def test_whatever_else_a_block_has_changes_nothing(
    text: str, delimiter: str, decimal: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    quick, usual = read(text, delimiter, decimal), by_pandas(monkeypatch, text, delimiter, decimal)
    for k in (0, 2):
        np.testing.assert_allclose(quick.columns[k], usual.columns[k], rtol=1e-15)
    assert (quick.bad, quick.grouped, quick.infinite, quick.lines) == (
        usual.bad,
        usual.grouped,
        usual.infinite,
        usual.lines,
    )
