"""Random damage to descriptions and logs: a result or a clear error, whatever is in the files; nothing half-written."""

from __future__ import annotations

import random
import shutil
from collections.abc import Iterator
from pathlib import Path

import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from vdyn_cli import steps
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.quantities.errors import VdynError

LONGEST = 1500  # lines of a log: enough to be a run, little enough to be quick
WORDS = ["", "-1", "0", "nan", "1e400", "[]", "{}", "null", "true", "km/h", "1,5", "'", "é", "- x", "x: y", "\t"]

quick = settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


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


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """Small copies of the sample descriptions and their logs, in one folder."""
    folder = tmp_path_factory.mktemp("day")
    for step in steps.names():
        text = (root / "configs" / f"{step}.yaml").read_text(encoding="utf-8")
        for name in set(files_of(yaml.safe_load(text))):
            source = (root / "configs" / name).resolve()
            text = text.replace(name, source.name)
            lines = source.read_bytes().splitlines(keepends=True)
            (folder / source.name).write_bytes(b"".join(lines[:LONGEST] if name.endswith(".csv") else lines))
        (folder / f"{step}.yaml").write_text(text, encoding="utf-8")
    return folder


def survives(step: str, folder: Path) -> None:
    """The step ends with whole files or with an error made of findings, and no file half-written."""
    out = folder / "out"
    shutil.rmtree(out, ignore_errors=True)
    failure = None
    try:
        write_step(step, folder / f"{step}.yaml", (), out, None)
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


@pytest.mark.parametrize("step", steps.names())
@quick
@given(st.integers(0, 2**32 - 1))
def test_a_damaged_description_gives_a_result_or_a_clear_error(step: str, day: Path, seed: int) -> None:
    chance = random.Random(seed)
    path = day / f"{step}.yaml"
    good = path.read_text(encoding="utf-8")
    try:
        path.write_text(damaged_text(good, chance), encoding="utf-8", errors="replace")
        survives(step, day)
    finally:
        path.write_text(good, encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize("step", steps.names())
@quick
@given(st.integers(0, 2**32 - 1))
def test_a_damaged_log_gives_a_result_or_a_clear_error(step: str, day: Path, seed: int) -> None:
    chance = random.Random(seed)
    described = yaml.safe_load((day / f"{step}.yaml").read_text(encoding="utf-8"))
    logs = sorted(name for name in set(files_of(described)) if not name.endswith(".yaml"))
    if not logs:
        return
    path = day / chance.choice(logs)
    good = path.read_bytes()
    try:
        path.write_bytes(damaged_bytes(good, chance))
        survives(step, day)
    finally:
        path.write_bytes(good)
