"""Faults around the program, one command each: ``python -m tests.bench.faults [word]`` writes tests/bench/faults.md.

Each case prepares a folder with copies of the sample descriptions and logs, runs the command line, and is clean if the
exit code is the expected one, the message says what is wrong, no traceback or bug is reported, it takes less than 30 s,
and every JSON in the folder is whole. A word runs the classes whose name holds it, and writes nothing.
"""

from __future__ import annotations

import json
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
from collections.abc import Sequence
from pathlib import Path

from tests.bench.fault_cases import CLASSES, ROOT, ROOT_PAGES, Case, nothing, small

START = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
LONGEST = 30.0  # s


def tried(case: Case) -> str:
    """What is broken in one case; empty where it is clean."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "configs", folder / "configs")
        (folder / "sample_logs").mkdir()
        for path in (ROOT / "sample_logs").iterdir():
            shutil.copy(path, folder / "sample_logs")
        case.prepare(folder)
        code, seconds, said = _run(case, folder)
        broken = []
        if code not in ((case.code,) if case.code >= 0 else (0, 1, 2)):
            broken.append(f"exit {code}")
        if re.search("Traceback|vdyn has a bug|Warning:", said):
            broken.append("traceback or warning")
        if not re.search(case.says, said):
            broken.append(f"says '{said[:100]}'")
        if seconds > LONGEST:
            broken.append(f"{seconds:.0f} s")
        try:
            for path in (folder / "out").glob("*.json") if code >= 0 else ():
                json.loads(path.read_text(encoding="utf-8"))
            if code == case.code or case.code < 0:
                case.after(folder)
        except (AssertionError, ValueError) as error:
            broken.append(str(error)[:100])
        return "; ".join(broken).replace("\n", " ")


def _run(case: Case, folder: Path) -> tuple[int, float, str]:
    program = f'{sys.executable} -c "{START}"'
    arguments = (
        ["bash", "-c", case.command.replace("VDYN", program)]
        if isinstance(case.command, str)
        else [sys.executable, "-c", START, *case.command]
    )
    environment = {**os.environ, "PYTHONPATH": str(ROOT), **case.environment}
    start = time.perf_counter()
    with (folder / "stderr").open("wb") as errors:
        try:
            done = subprocess.run(
                arguments, cwd=folder / "configs", env=environment, stdout=errors, stderr=errors,
                timeout=4 * LONGEST, check=False,
            )  # fmt: skip
            code = done.returncode
        except subprocess.TimeoutExpired:
            code = -1
    return code, time.perf_counter() - start, (folder / "stderr").read_text(encoding="utf-8", errors="replace")


def main(word: str = "") -> None:
    """Try all cases, print them, and write the table."""
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        shutil.copytree(ROOT / "configs", folder / "configs")
        shutil.copytree(ROOT / "sample_logs", folder / "sample_logs")
        small(folder)
        code, _, said = _run(Case("", "", nothing, "VDYN pipeline small.yaml -o ../out", 0), folder)
        assert code == 0, said
        shutil.copytree(folder / "out", ROOT_PAGES)
    rows, broken = [], []
    try:
        for make in CLASSES:
            cases = [case for case in make() if word in case.group]
            faults = []
            for case in cases:
                fault = tried(case)
                print(f"{'broken' if fault else 'clean ':6}  {case.group}: {case.name[:60]}  {fault}", flush=True)
                faults += [f"{case.group}, {case.name[:60]}: {fault}"] if fault else []
            if cases:
                rows.append(f"| {cases[0].group} | {len(cases)} | {len(cases) - len(faults)} | {len(faults)} |")
            broken += faults
    finally:
        shutil.rmtree(ROOT_PAGES)
    if not word:
        _write(rows, broken)


def _write(rows: Sequence[str], broken: Sequence[str]) -> None:
    lines = [
        "# Faults around the program",
        "",
        "Written by `python -m tests.bench.faults`. A case is clean if the exit code is the expected one, the message "
        "says what is wrong, no traceback, bug or library warning is printed, it ends within 30 s, every JSON is "
        "whole, and, where results exist, they have the bytes of an undisturbed run.",
        "",
        "| class | tried | clean | broken |",
        "|---|---|---|---|",
        *rows,
        "",
        *(["## Broken", "", *(f"* {one}" for one in broken)] if broken else ["Nothing is broken."]),
    ]
    (ROOT / "tests" / "bench" / "faults.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main(*sys.argv[1:2])
