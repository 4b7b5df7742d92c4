"""Results in the output folder are reused only if they are complete, unedited, and computed from the present inputs."""

from __future__ import annotations

import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from hashlib import sha256
from pathlib import Path

import pytest

from tests.project.pipeline_runs import diagnosed, run
from vdyn_cli.commands import run_pipeline as pipeline_command
from vdyn_cli.commands.run_pipeline import run_pipeline
from vdyn_cli.commands.run_step import run_step
from vdyn_cli.io import fingerprinted_reading
from vdyn_cli.io.fingerprinted_reading import read_unchanged
from vdyn_cli.io.folder_lock import pipeline_lock
from vdyn_cli.project import inputs
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import InputError


def statuses(day: Path) -> dict[str, str]:
    """What the pipeline did with each step."""
    told: list[str] = []
    out = day.parent / "out"
    run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=1, tell=lambda text, detail=False: told.append(text))
    return {line.split()[1]: line.split()[2] for line in told if line.startswith("[")}


def whole(folder: Path) -> dict[str, bytes]:
    return {str(p.relative_to(folder)): p.read_bytes() for p in folder.rglob("*") if p.is_file()}


EDITS: dict[str, Callable[[str], str]] = {
    "another value": lambda text: text.replace('"value": 2.1', '"value": 3.1', 1),
    "another sentence": lambda text: text.replace("The frontal area", "The best frontal area", 1),
    "null": lambda text: re.sub(r'"value": [\d.]+', '"value": null', text, count=1),
    "a wrong type": lambda text: re.sub(r'"warnings": \[.*?\]', '"warnings": 7', text, count=1, flags=re.S),
    "no key": lambda text: text.replace('"fit"', '"fitt"', 1),
    "nested": lambda text: "[" * 100_000,
    "cut": lambda text: text[: len(text) // 2],
    "empty": lambda text: "",
    "a list": lambda text: "[]",
}
FAST_EDITS = ("null", "cut")


@pytest.mark.parametrize("edit", [e if e in FAST_EDITS else pytest.param(e, marks=pytest.mark.slow) for e in EDITS])
def test_an_edited_json_is_computed_anew(edit: str, day: Path) -> None:
    out = day.parent / "out"
    first, path = whole(out), out / "area.json"
    path.write_text(EDITS[edit](path.read_text(encoding="utf-8")), encoding="utf-8")
    assert path.read_bytes() != first["area.json"]
    assert statuses(day) == {"tire": "reused", "cg": "reused", "area": "done"}
    assert whole(out) == first


@pytest.mark.parametrize("name", ["area.html", ".sections/area.html"])
@pytest.mark.parametrize("edit", ["script", "gone", "not text"])
def test_an_edited_page_or_section_is_computed_anew(name: str, edit: str, day: Path) -> None:
    out = day.parent / "out"
    first = whole(out)
    if edit == "gone":
        (out / name).unlink()
    else:
        (out / name).write_bytes(first[name] + (b"<script>alert(1)</script>" if edit == "script" else b"\xff\xfe"))
    assert statuses(day)["area"] == "done"
    assert whole(out) == first


def test_a_result_of_another_step_under_this_name_is_computed_anew(day: Path) -> None:
    out = day.parent / "out"
    first = whole(out)
    for ending in ("json", "html"):
        shutil.copy(out / f"tire.{ending}", out / f"area.{ending}")
    shutil.copy(out / ".sections" / "tire.html", out / ".sections" / "area.html")
    assert statuses(day)["area"] == "done"
    assert whole(out) == first


def test_the_fingerprint_is_that_of_the_bytes_that_were_read(
    day: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The log is replaced after it was read and before the result is written."""
    logs = day.parent / "sample_logs"
    kept = logs.resolve()
    logs.unlink()
    shutil.copytree(kept, logs)
    log = logs / "slip_1.csv"
    before = sha256(log.read_bytes()).hexdigest()
    read = inputs.logged_test

    def read_then_replace(*arguments: object) -> object:
        found = read(*arguments)  # type: ignore[arg-type]
        log.write_bytes(b"another log")
        return found

    monkeypatch.setattr("vdyn_cli.project.execute.logged_test", read_then_replace)
    record = execute("tire", day / "tire.yaml", (), None)
    assert record.provenance.inputs["../sample_logs/slip_1.csv"] == before


def test_a_file_that_changes_while_it_is_read_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "log.csv"
    path.write_text("0")

    def read() -> tuple[str, tuple[Path, ...]]:
        text = path.read_text()
        path.write_text(text + "1")
        return text, (path,)

    for files in ((path,), None):
        with pytest.raises(InputError, match="changed while it was being read"):
            read_unchanged(read, files)


@pytest.mark.parametrize("how", ["written", "renamed", "relinked"])
def test_a_file_replaced_after_it_was_read_does_not_give_its_fingerprint(how: str, tmp_path: Path) -> None:
    """Replaced once, between reading and the fingerprint: read again, with the fingerprint of what was read last."""
    path, other = tmp_path / "log.csv", tmp_path / "other.csv"
    (tmp_path / "first.csv").write_text("first")
    path.symlink_to("first.csv")
    other.write_text("other")
    for file in (tmp_path / "first.csv", other):
        os.utime(file, (1e9, 1e9))
    time.sleep(0.05)
    count: list[str] = []

    def read() -> tuple[str, tuple[Path, ...]]:
        text = path.read_text()
        if not count:
            if how == "written":
                path.write_text("other")
            elif how == "renamed":
                shutil.copy(other, tmp_path / "new.csv")
                os.replace(tmp_path / "new.csv", path)
            else:
                path.unlink()
                path.symlink_to("other.csv")
        count.append(text)
        return text, (path,)

    text, digests = read_unchanged(read, (path,))
    assert digests[path] == sha256(text.encode()).hexdigest()
    assert text == "other"


def test_an_old_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fingerprinted_reading, "RECENT", 0.0)
    path, count = tmp_path / "log.csv", []
    path.write_text("x")
    time.sleep(0.05)
    read_unchanged(lambda: (count.append(1), (path,)), (path,))
    assert count == [1]


def test_a_folder_that_a_pipeline_writes_to_is_refused(day: Path) -> None:
    out = day.parent / "out"
    first = whole(out)
    with pipeline_lock(out):
        with pytest.raises(InputError, match="another run of vdyn writes its results here"):
            run(day, "out")
        with pytest.raises(InputError, match="another run of vdyn"):
            run_step("area", day / "area.yaml", (), str(out), None)
    assert whole(out) == first
    run_step("area", day / "area.yaml", (), str(out), None)


@pytest.mark.slow
def test_page_and_parameters_are_replaced_together(
    day: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Ended between the two files: no page is left next to parameters that it does not show."""
    out = day.parent / "out"
    replace = Path.replace

    def ended(self: Path, target: Path) -> Path:
        if target.name in ("report.html", "area.html"):
            raise KeyboardInterrupt
        return replace(self, target)

    (day / "vehicle.yaml").write_text((day / "vehicle.yaml").read_text() + "\n# changed\n")
    monkeypatch.setattr(Path, "replace", ended)
    with pytest.raises(KeyboardInterrupt):
        run(day, "out")
    assert (out / "parameters.json").exists()
    assert not (out / "report.html").exists()
    assert not list(out.glob(".*tmp"))


def test_what_killed_writers_left_is_removed(day: Path) -> None:
    out = day.parent / "out"
    left = (out / ".area.html.abc.vdyn-tmp", out / ".sections" / ".area.html.abc.vdyn-tmp")
    for path in left:
        path.write_text("half")
    (out / ".mine").write_text("kept")
    statuses(day)
    assert not any(path.exists() for path in left)
    assert (out / ".mine").exists()


@pytest.mark.slow
def test_a_step_whose_process_is_killed_costs_no_other(day: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    out = day.parent / "again"
    execute = pipeline_command.execute

    def killed(name: str, *arguments: object) -> object:
        if name == "cg":
            os.kill(os.getpid(), signal.SIGKILL)
        return execute(name, *arguments)  # type: ignore[arg-type]

    monkeypatch.setattr(pipeline_command, "execute", killed)
    code = run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=2, tell=lambda text, detail=False: None)
    steps = json.loads((out / "parameters.json").read_text())["steps"]
    assert code == 70
    assert {name: step["good"] for name, step in steps.items()} == {"tire": True, "cg": False, "area": True}
    assert "signal 9" in (out / "report.html").read_text()


def ends_within(group: int, seconds: float) -> bool:
    """Whether all processes of a group end in time; steps look for their parent a few times a second when not busy."""
    latest = time.monotonic() + seconds
    while time.monotonic() < latest:
        try:
            os.killpg(group, 0)
        except ProcessLookupError:
            return True
        time.sleep(0.1)
    return False


OTHERS = [pytest.param(one, marks=pytest.mark.thorough) for one in (signal.SIGKILL, signal.SIGINT)]


@pytest.mark.slow  # starts and ends whole pipelines
@pytest.mark.parametrize("number", [signal.SIGTERM, *OTHERS])
def test_no_process_outlives_the_pipeline(number: signal.Signals, day: Path) -> None:
    diagnosed(day, "cg", "tire")  # so that it runs long enough to be ended
    out = day.parent / "ended"
    start = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
    arguments = [sys.executable, "-c", start, "pipeline", str(day / "pipeline.yaml"), "-o", str(out), "--jobs", "2"]
    process = subprocess.Popen(arguments, stderr=subprocess.PIPE, start_new_session=True)
    while not (out / ".sections").exists():
        time.sleep(0.05)
    process.send_signal(number)
    process.communicate(timeout=30)
    assert ends_within(process.pid, 30.0)
    for path in out.glob("*.json"):
        json.loads(path.read_text())
