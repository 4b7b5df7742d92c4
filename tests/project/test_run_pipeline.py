"""The pipeline on sample logs: the parameter set, failures, reuse of results, and the same bytes as single steps."""

from __future__ import annotations

import json
import re
import shutil
import subprocess
from pathlib import Path

import pytest

from tests.project.pipeline_runs import diagnosed, run, silent
from vdyn_cli.commands import step_processes
from vdyn_cli.commands.run_pipeline import run_pipeline
from vdyn_cli.commands.run_step import write_step
from vdyn_cli.diagnosis.policy import shared_level
from vdyn_cli.project import result_document
from vdyn_cli.project.pipeline import load_plan
from vdyn_cli.quantities.vocabulary import TABLE


def test_every_parameter_is_there_or_said_to_be_missing(day: Path) -> None:
    document = json.loads((day.parent / "out" / "parameters.json").read_text())
    known, missing = set(document["parameters"]), set(document["missing"])
    assert known | missing >= set(TABLE)
    assert not known & missing
    assert document["parameters"]["mass"]["source"] == "given"
    assert document["parameters"]["cg_height"]["source"] == "cg"
    assert "no 'coastdown' test" in document["missing"]["rolling_resistance"]
    page = (day.parent / "out" / "report.html").read_text()
    assert "a day" in page


@pytest.mark.slow  # three whole pipelines
def test_side_by_side_step_by_step_and_again_the_bytes_are_the_same(day: Path) -> None:
    diagnosed(day, "tire")
    run(day, "out")
    run(day, "two", jobs=2)
    alone = day.parent / "alone"
    for name in ("area", "cg", "tire"):
        write_step(name, day / f"{name}.yaml", (), alone, shared_level(2))
    out = day.parent / "out"
    files = sorted(str(p.relative_to(out)) for p in out.rglob("*") if p.is_file())
    own = [f"{name}.{ending}" for name in ("area", "cg", "tire") for ending in ("html", "json")]
    sections = [f".sections/{name}.html" for name in ("area", "cg", "tire")]
    assert files == sorted(["report.html", "parameters.json", *own, *sections])
    for name in files:
        first = (day.parent / "out" / name).read_bytes()
        assert first == (day.parent / "two" / name).read_bytes(), name
        if (alone / name).exists():
            assert first == (alone / name).read_bytes(), name


def test_what_is_unchanged_is_reused_and_what_changed_is_not(day: Path) -> None:
    told: list[str] = []

    def tell(text: str, detail: bool = False) -> None:
        told.append(text)

    out = day.parent / "out"
    first = (out / "report.html").read_bytes()
    vehicle = day / "vehicle.yaml"
    run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=1, tell=tell)
    assert sum("reused" in line for line in told) == 3
    assert (out / "report.html").read_bytes() == first
    told.clear()
    vehicle.write_text(vehicle.read_text().replace("antenna_height: 1.52 m", "antenna_height: 1.53 m"))
    run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=1, tell=tell)
    statuses = [line.split()[1:3] for line in told if line.startswith("[")]
    assert statuses == [["tire", "done"], ["cg", "done"], ["area", "reused"]]


def test_without_changes_no_process_is_started(day: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(step_processes, "_load_shared", lambda: pytest.fail("loaded for no step"))
    told: list[str] = []
    out = day.parent / "out"
    run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=2, tell=lambda text, detail=False: told.append(text))
    assert sum("reused" in line for line in told) == 3


@pytest.mark.parametrize("damage", [pytest.param("missing", marks=pytest.mark.slow), "of another result"])
def test_a_step_without_its_section_runs_again(day: Path, damage: str) -> None:
    out = day.parent / "out"
    section, page = out / ".sections" / "tire.html", (out / "report.html").read_bytes()
    assert section.read_bytes().partition(b"\n")[2] in page
    if damage == "missing":
        section.unlink()
    else:
        section.write_text("<!-- of the JSON with sha256 0 -->\n<p>another result</p>")
    told: list[str] = []
    run_pipeline(day / "pipeline.yaml", out, keep_going=True, jobs=1, tell=lambda text, detail=False: told.append(text))
    assert next(line.split()[1:3] for line in told if line.startswith("[")) == ["tire", "done"]
    assert (out / "report.html").read_bytes() == page


def test_a_failed_step_costs_no_other_and_is_said(day: Path) -> None:
    good = (day.parent / "out" / "tire.json").read_bytes()
    (day / "tire.yaml").write_text((day / "tire.yaml").read_text().replace("Fx [N]", "F x [N]"))
    code, document = run(day, "out")
    assert code == 2
    assert document["steps"]["tire"]["good"] is False
    assert document["steps"]["area"]["good"] is True
    assert "tire failed" in document["missing"]["tire_D"]
    assert (day.parent / "out" / "tire.json").read_bytes() == good
    page = (day.parent / "out" / "report.html").read_text()
    assert "F x [N]" in page


@pytest.mark.slow
def test_a_sensor_that_did_not_measure_is_reported_on_the_console_and_in_the_set(day: Path) -> None:
    told: list[str] = []

    def tell(text: str, detail: bool = False) -> None:
        told.append(text)

    diagnosed(day, "tire")
    logs = day.parent / "sample_logs"
    kept = logs.resolve()
    logs.unlink()
    shutil.copytree(kept, logs)
    for path in logs.glob("slip_*.csv"):
        head, first, *rows = [line.split(",") for line in path.read_text(encoding="utf-8").splitlines()]
        column = next(k for k, name in enumerate(head) if "Fz" in name)
        for row in rows:
            row[column] = first[column]
        path.write_text("\n".join(",".join(row) for row in (head, first, *rows)) + "\n", encoding="utf-8")
    run_pipeline(day / "pipeline.yaml", day.parent / "out", keep_going=True, jobs=1, tell=tell)
    document = json.loads((day.parent / "out" / "parameters.json").read_text())
    assert document["steps"]["tire"]["verdict"] == "data_fault"
    assert "is constant in the whole log" in document["steps"]["tire"]["diagnosis"]
    assert any("Data fault" in line for line in told)
    assert any("with warnings" in line for line in told)


def test_stop_skips_what_comes_after_a_failure(day: Path) -> None:
    (day / "tire.yaml").write_text("test: tire\nnonsense: 1\n")
    code = run_pipeline(day / "pipeline.yaml", day.parent / "out", keep_going=False, jobs=1, tell=silent)
    document = json.loads((day.parent / "out" / "parameters.json").read_text())
    assert code == 2
    assert "skipped because tire failed" in document["steps"]["cg"]["sentence"]


def test_the_makefile_says_what_the_pipeline_does(root: Path) -> None:
    """One rule per step passes on the same results in the same order, so that the bytes are the same."""
    make = shutil.which("make")
    if make is None:
        pytest.skip("make is not installed")
    command = [make, "-n", "-B", "OUT=o", "VDYN=vdyn"]
    shown = subprocess.run(command, cwd=root, capture_output=True, text=True, check=True)
    said = {line.split()[1]: re.findall(r"--known o/(\w+)\.json", line) for line in shown.stdout.splitlines()}
    _, _, tasks = load_plan(root / "configs" / "pipeline.yaml")
    assert said == {task.name: list(task.after) for task in tasks}


def test_a_changed_program_computes_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    before = result_document.versions()["vdyn_cli"]
    assert re.fullmatch(r"\d+\.\d+\.\d+\+[0-9a-f]{8}", before)
    monkeypatch.setattr(result_document, "SOURCES", {".css"})
    assert result_document.versions.__wrapped__()["vdyn_cli"] != before
