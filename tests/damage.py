"""Random damage to the sample descriptions and logs, for the tests and for the campaign of the bench."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import yaml

from vdyn_cli import steps
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.quantities.errors import VdynError

LONGEST = 1500  # lines of a log: enough to be a run, little enough to be quick
WORDS = ["", "-1", "0", "nan", "1e400", "[]", "{}", "null", "true", "km/h", "1,5", "'", "é", "- x", "x: y", "\t"]


def files_of(value: object) -> Iterator[str]:
    """Every file that a description names."""
    if isinstance(value, dict):
        for child in value.values():
            yield from files_of(child)
    elif isinstance(value, list):
        for child in value:
            yield from files_of(child)
    elif isinstance(value, str) and value.endswith((".csv", ".png", ".yaml")):
        yield value


def small_day(root: Path, folder: Path, longest: int | None = LONGEST) -> Path:
    """Copies of the sample descriptions and of the first lines of their logs, in one folder."""
    for step in steps.names():
        text = (root / "configs" / f"{step}.yaml").read_text(encoding="utf-8")
        for name in set(files_of(yaml.safe_load(text))):
            source = (root / "configs" / name).resolve()
            text = text.replace(name, source.name)
            lines = source.read_bytes().splitlines(keepends=True)
            (folder / source.name).write_bytes(b"".join(lines[:longest] if name.endswith(".csv") else lines))
        (folder / f"{step}.yaml").write_text(text, encoding="utf-8")
    return folder


def logs_of(step: str, folder: Path) -> list[str]:
    """The logs, images and other files that a step's description names."""
    described = yaml.safe_load((folder / f"{step}.yaml").read_text(encoding="utf-8"))
    return sorted(name for name in set(files_of(described)) if not name.endswith(".yaml"))


def survives(step: str, folder: Path, level: float | None = None, known: tuple[Path, ...] = ()) -> int:
    """The exit code of a step that ends with whole files or an error made of findings, and nothing half-written.

    Parameters
    ----------
    level : of the diagnosis; None leaves it out. known : parameter files.
    """
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    failure = None
    try:
        write_step(step, folder / f"{step}.yaml", known, out, level)
    except VdynError as error:
        failure = error
    left = {p.name for p in out.iterdir()} if out.exists() else set()
    if failure is None or failure.exit_code == 1:
        assert left == {f"{step}.json", f"{step}.html", ".sections"}
    else:
        assert left == set()
    if failure is not None:
        assert failure.findings
        assert all(f.where and f.what for f in failure.findings)
    return 0 if failure is None else failure.exit_code


def damaged_text(text: str, chance: random.Random) -> str:
    """A few lines dropped, repeated, swapped, cut or with a word in their middle."""
    lines = text.splitlines()
    for _ in range(chance.randint(1, 3)):
        at = chance.randrange(len(lines))
        line, cut = lines[at], chance.randrange(len(lines[at]) + 1)
        lines[at : at + 1] = chance.choice(
            (
                [],
                [line, line],
                [line[:cut]],
                [line[:cut] + chance.choice(WORDS) + line[cut:]],
                [line[:cut] + chance.choice(WORDS)],
                [lines[chance.randrange(len(lines))]],
                ["  " + line],
            )
        )
        lines = lines or [""]
    return "\n".join(lines)


def damaged_bytes(data: bytes, chance: random.Random) -> bytes:
    """Bytes flipped, cut out, put in, the end torn off, or rows shuffled."""
    whole = bytearray(data)
    for _ in range(chance.randint(1, 4)):
        at = chance.randrange(len(whole) + 1)
        kind = chance.randrange(6)
        if kind == 0:
            whole[at : at + 1] = bytes([chance.randrange(256)])
        elif kind == 1:
            del whole[at : at + chance.choice((1, 20, 2000))]
        elif kind == 2:
            whole[at:at] = chance.choice((b"\n", b",,,,", b'"', b"\x00", b"NaN", b"text", b"\xff\xfe", b"1e999"))
        elif kind == 3:
            del whole[at:]
        elif kind == 4:
            rows = bytes(whole).split(b"\n")
            chance.shuffle(rows)
            whole = bytearray(b"\n".join(rows))
        else:
            whole[at:at] = whole[: chance.choice((10, 500))]
        whole = whole or bytearray(b" ")
    return bytes(whole)
