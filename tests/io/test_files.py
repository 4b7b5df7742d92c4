"""Files are written completely or not at all."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from vdyn_cli.io.files import distinct_names, write_whole
from vdyn_cli.quantities.errors import InputError

WRITER = """
import sys
from pathlib import Path
from vdyn_cli.io.files import write_whole
print("ready", flush=True)
n = 0
while True:
    n += 1
    write_whole(Path(sys.argv[1]), chr(97 + n % 26) * 2_000_000)
"""


def test_equal_file_names_are_reported_with_their_folders() -> None:
    paths = [Path("a/1/gps.csv"), Path("b/1/gps.csv"), Path("a/2/gps.csv"), Path("gps.csv"), Path("a/can.csv")]
    assert list(distinct_names(paths).values()) == ["a/1/gps.csv", "b/1/gps.csv", "2/gps.csv", "gps.csv", "can.csv"]
    assert distinct_names([Path()]) == {Path(): "."}


def test_an_unwritable_place_is_an_input_error(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("x")
    with pytest.raises(InputError, match="file: is a file, not a folder"):
        write_whole(tmp_path / "file" / "below.json", "x")


def test_a_failed_write_leaves_the_good_file_and_no_rubbish(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.json"
    write_whole(path, "good")
    monkeypatch.setattr(os, "fsync", lambda _: (_ for _ in ()).throw(OSError(28, "No space left on device")))
    with pytest.raises(InputError, match="No space left"):
        write_whole(path, "half")
    assert path.read_text() == "good"
    assert [p.name for p in tmp_path.iterdir()] == ["a.json"]


@pytest.mark.parametrize("delay", [0.0, 0.003, 0.011, 0.029])
def test_killed_at_any_moment_the_file_is_whole(tmp_path: Path, delay: float, root: Path) -> None:
    path = tmp_path / "a.json"
    environment = {**os.environ, "PYTHONPATH": str(root)}
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(path)], stdout=subprocess.PIPE, env=environment)
    assert process.stdout is not None
    process.stdout.readline()
    while not path.exists():
        time.sleep(0.001)
    time.sleep(delay)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()
    text = path.read_text()
    assert len(text) == 2_000_000
    assert len(set(text)) == 1


def test_a_folder_is_not_replaced_by_a_file(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"is a folder\n    -> name a file in it"):
        write_whole(tmp_path, "x")
