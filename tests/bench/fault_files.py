"""Damaged files for ``tests.bench.faults``; as a command, a run of vdyn that is ended by a signal."""

from __future__ import annotations

import json
import subprocess
import sys
import time
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from tests.export.cases import document

# A parameter file that export to every format accepts; entries are replaced by (value, unit).
PLAIN: Mapping[str, Any] = {}


def edited(path: Path, old: str, new: str) -> None:
    """Replace a text that the file must hold."""
    text = path.read_text(encoding="utf-8")
    assert old in text, f"{path.name} has no '{old}'"
    path.write_text(text.replace(old, new, 1), encoding="utf-8")


def replaced(name: str, content: bytes | None) -> Callable[[Path], None]:
    """Write a file, or remove it."""

    def change(folder: Path) -> None:
        if content is None:
            (folder / name).unlink()
        else:
            (folder / name).write_bytes(content)

    return change


def edited_known(changes: Mapping[str, Any]) -> Callable[[Path], None]:
    """Write ``known.json`` with entries of other values and units, and other keys."""

    def change(folder: Path) -> None:
        made = {**document(), "diagnosis": None}
        for name, value in changes.items():
            if isinstance(value, tuple):
                entry = {"std": 0.0, "interval95": [0.0, 0.0], "meaning": "", "source": "given", "baseline": None}
                made["parameters"][name] = {**entry, "value": value[0], "unit": value[1]}
            else:
                made[name] = value
        (folder / "known.json").write_text(json.dumps(made), encoding="utf-8")

    return change


def with_quotes(count: int) -> Callable[[Path], None]:
    """A quote before the first column's name, one some lines below; without any, an escape sequence in each name."""

    def change(folder: Path) -> None:
        path = folder / "sample_logs" / "launch_1.csv"
        lines = path.read_text(encoding="utf-8").replace('"', "").splitlines()
        if count == 0:
            lines[0] = ",".join("\x1b[31m" + name for name in lines[0].split(","))
        else:
            lines[0] = '"' + lines[0]
        if count == 2:
            lines[4] = lines[4].replace(",", ',"', 1)
        path.write_text("\n".join(lines) + "\n", encoding="utf-8")

    return change


def swapped_units(unit: str) -> Callable[[Path], None]:
    """A units row below the header, with one unit in all columns."""

    def change(folder: Path) -> None:
        path = folder / "sample_logs" / "launch_1.csv"
        head, *rows = path.read_text(encoding="utf-8").splitlines()
        path.write_text("\n".join([head, ",".join([unit] * len(head.split(","))), *rows]) + "\n", encoding="utf-8")

    return change


def end_by_signal(number: int, delay: float, arguments: list[str]) -> None:
    """Start vdyn, send it a signal after a delay, and wait until it and its processes have ended.

    Raises
    ------
    AssertionError : a process is left 2 s after its end.
    """
    start = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
    process = subprocess.Popen([sys.executable, "-c", start, *arguments], start_new_session=True)
    time.sleep(delay)
    process.send_signal(number)
    process.wait()
    time.sleep(2.0)
    group = subprocess.run(["ps", "-o", "stat=", "-g", str(process.pid)], capture_output=True, text=True, check=False)
    left = [state for state in group.stdout.split() if not state.startswith("Z")]  # a zombie has ended
    assert not left, "Traceback: processes are left"


if __name__ == "__main__":
    end_by_signal(int(sys.argv[1]), float(sys.argv[2]), sys.argv[3:])
