"""Cached machine code is used only if it is complete and only the user can write it; else the text is compiled."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import pytest

from vdyn_cli.engine import object_cache
from vdyn_cli.engine.object_cache import VARIABLE, cached

CODE = bytes(range(256)) * 20


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    monkeypatch.setenv(VARIABLE, str(tmp_path / "kept"))
    return tmp_path / "kept"


def made(*parts: str, code: bytes = CODE) -> tuple[bytes, bool]:
    """The code of these parts, and whether it was compiled."""
    calls: list[int] = []

    def make() -> bytes:
        calls.append(1)
        return code

    return cached(parts, make), bool(calls)


def test_the_same_text_is_compiled_once(folder: Path) -> None:
    assert made("text", "cpu") == (CODE, True)
    assert made("text", "cpu", code=b"") == (CODE, False)
    assert made("text", "other cpu") == (CODE, True)
    assert made("textcpu", "") == (CODE, True)
    assert folder.stat().st_mode & 0o777 == 0o700
    assert not list(folder.glob("*.part"))


@pytest.mark.parametrize("damage", ["cut", "flipped", "emptied", "garbage"])
def test_a_damaged_file_is_compiled_anew(folder: Path, damage: str) -> None:
    made("text")
    (file,) = folder.glob("*.o")
    content = file.read_bytes()
    flipped = bytes([content[700] ^ 1])
    file.write_bytes(
        {"cut": content[:-1], "flipped": content[:700] + flipped + content[701:], "emptied": b"", "garbage": b"x" * 99}[
            damage
        ]
    )
    assert made("text") == (CODE, True)
    assert made("text") == (CODE, False)


@pytest.mark.skipif(not hasattr(os, "getuid"), reason="no owners of files here")
def test_what_others_could_have_written_is_not_run(folder: Path) -> None:
    made("text")
    (file,) = folder.glob("*.o")
    file.chmod(0o666)
    assert made("text")[1]
    folder.chmod(0o777)
    assert made("text")[1]
    folder.chmod(0o700)
    target = folder / "target"
    file.rename(target)
    file.symlink_to(target)
    assert made("text")[1]


@pytest.mark.parametrize("place", ["", "file/kept", "/dev/null/kept"])
def test_without_a_folder_the_text_is_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: str) -> None:
    (tmp_path / "file").write_text("", encoding="utf-8")
    monkeypatch.setenv(VARIABLE, place and str(tmp_path / place))
    assert made("text") == (CODE, True)
    assert made("text") == (CODE, True)


def test_what_was_not_used_for_longest_is_removed(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(object_cache, "MOST_FILES", 3)
    for k, name in enumerate("abc"):
        before = set(folder.glob("*.o"))
        made(name)
        (new,) = set(folder.glob("*.o")) - before
        os.utime(new, (k, k))
    made("a")
    made("d")
    assert [made(name)[1] for name in "ad"] == [False, False]
    assert made("b")[1]


def test_kept_code_computes_what_new_code_does(folder: Path) -> None:
    program = (
        "import numpy as np; from vdyn_cli.engine.native import compiled\n"
        "text = '''declare double @sin(double)\ndefine void @run(i64 %n, i64 %e, i64 %g, ptr %z, ptr %u, ptr %d,"
        " ptr %p, ptr %t, ptr %w, ptr %x) {\n%a = load double, ptr %z\n%b = call double @sin(double %a)\n"
        "store double %b, ptr %z\nret void\n}'''\n"
        "z = np.ones(1); run, owner = compiled(text); run(1, 1, 0, z.ctypes.data, *[0] * 6); print(z[0].hex())"
    )
    seen = [
        subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True) for _ in range(2)
    ]
    assert seen[0].stdout == seen[1].stdout
    assert len(list(folder.glob("*.o"))) == 1
