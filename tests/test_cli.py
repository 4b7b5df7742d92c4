"""The command line as a user meets it: help, exit codes, clear messages, whole files."""

from __future__ import annotations

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest
import yaml
from typer.testing import CliRunner

from tests.result_check import check_result
from vdyn_cli import steps
from vdyn_cli.cli import app, main

RUN = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
Run = Callable[..., subprocess.CompletedProcess[str]]


@pytest.fixture(scope="module")
def vdyn_process(root: Path) -> Run:
    """`vdyn` in a process of its own."""

    def run(*arguments: object) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(root)}
        command = [sys.executable, "-c", RUN, *map(str, arguments)]
        return subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, timeout=120)

    return run


@pytest.fixture
def vdyn(root: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Run:
    """`vdyn` in this process, from the entry point to the exit code."""

    def run(*arguments: object, folder: Path = root) -> subprocess.CompletedProcess[str]:
        monkeypatch.chdir(folder)
        monkeypatch.setattr(sys, "argv", ["vdyn", *map(str, arguments)])
        with pytest.raises(SystemExit) as ended:
            main()
        out, error = capsys.readouterr()
        return subprocess.CompletedProcess(sys.argv, int(ended.value.code or 0), out, error)

    return run


def test_help_imports_nothing_heavy(root: Path) -> None:
    code = (
        "import sys; sys.argv = ['vdyn', '--help']\n"
        "from vdyn_cli.cli import main\n"
        "try: main()\n"
        "except SystemExit as e: assert not e.code, e.code\n"
        "heavy = set('numpy pandas scipy matplotlib casadi llvmlite pint pydantic jinja2 yaml'.split())\n"
        "assert not heavy & set(sys.modules), heavy & set(sys.modules)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], cwd=root, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    for name in steps.names():
        assert name in done.stdout


@pytest.mark.parametrize("name", steps.names())
def test_every_step_has_a_command_an_explanation_a_schema_and_a_sample(name: str, root: Path) -> None:
    def told(*arguments: str) -> str:
        done = CliRunner().invoke(app, arguments)
        assert done.exit_code == 0, done.stderr
        return done.stdout

    assert "TEST.yaml" in told(name, "--help")
    assert steps.summary(name)
    assert "source" in told("explain", name).lower()
    schema = json.loads(told("schema", name))
    sample = yaml.safe_load((root / "configs" / f"{name}.yaml").read_text())
    jsonschema.validate(sample, schema)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate({**sample, "unknown_key": 1})


def test_the_steps_give_the_json_on_stdout_alone(vdyn_process: Run) -> None:
    done = vdyn_process("tire", "configs/tire.yaml", "--no-diagnose", "-o", "-", "-q")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["format"] == "vdyn/parameters/1"
    assert document["diagnosis"] is None
    assert "--no-diagnose" in document["provenance"]["command"]
    check_result(document)
    assert done.stderr == ""


@pytest.mark.slow  # a diagnosis twice
def test_same_inputs_give_the_same_bytes_in_another_process(vdyn: Run, vdyn_process: Run, tmp_path: Path) -> None:
    for folder, run in (("a", vdyn), ("b", vdyn_process)):
        assert run("inertia", "configs/inertia.yaml", "-o", tmp_path / folder).returncode == 0
    for name in ("inertia.json", "inertia.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


BAD = {
    "no such file": ("nowhere.yaml", None, "does not exist"),
    "another test": ("t.yaml", "test: bump\n", "test type mismatch"),
    "unknown key": ("t.yaml", "test: tire\nchanels: {}\n", "did you mean channels"),
    "unknown channel": ("t.yaml", "test: tire\nchannels: {sped: {column: a, unit: m/s}}\n", "unknown channel 'sped'"),
    "no channels": ("t.yaml", "test: tire\nruns: [{log: a.csv}]\n", "channel force_x is needed"),
    "no runs": ("t.yaml", "test: tire\n", "no run is given"),
    "not YAML": ("t.yaml", "test: [tire\n", "not valid YAML"),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_input_is_exit_2_one_message_and_no_file(case: str, vdyn: Run, tmp_path: Path) -> None:
    name, text, says = BAD[case]
    if text is not None:
        (tmp_path / name).write_text(text)
    done = vdyn("tire", name, "-o", "out", folder=tmp_path)
    assert done.returncode == 2, done.stderr
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_usage_errors_and_unknown_topics(vdyn: Run) -> None:
    assert vdyn("tire").returncode == 2
    assert vdyn("tyre", "x.yaml").returncode == 2
    done = vdyn("explain", "coastdwn")
    assert done.returncode == 2
    assert "did you mean coastdown" in done.stderr
    assert vdyn("explain", "headwind").returncode == 0
    assert "Cd A" in vdyn("explain", "drag_area").stdout
    listed = vdyn("list").stdout
    for name in (*steps.names(), "headwind"):
        assert name in listed


def test_a_description_of_the_other_kind_names_its_command(vdyn: Run) -> None:
    """One message where each key would be wrong."""
    for command, file, remedy in (
        ("pipeline", "tire", "run 'vdyn tire configs/tire.yaml'"),
        ("tire", "pipeline", "run 'vdyn pipeline configs/pipeline.yaml'"),
        ("check", "pipeline", "run 'vdyn pipeline configs/pipeline.yaml'"),
    ):
        done = vdyn(command, f"configs/{file}.yaml")
        assert (done.returncode, remedy in done.stderr, done.stderr.count("->")) == (2, True, 1), done.stderr


def test_a_pipeline_does_not_write_to_stdout(vdyn: Run) -> None:
    done = vdyn("pipeline", "configs/pipeline.yaml", "-o", "-")
    assert (done.returncode, "name a folder" in done.stderr) == (2, True), done.stderr


def test_version(vdyn: Run) -> None:
    assert re.fullmatch(r"vdyn \d+\.\d+\.\d+\n", vdyn("--version").stdout)


def test_a_known_file_that_is_none_is_refused(vdyn: Run, tmp_path: Path) -> None:
    (tmp_path / "k.json").write_text("{")
    done = vdyn("tire", "configs/tire.yaml", "--known", tmp_path / "k.json", "-o", tmp_path / "out")
    assert (done.returncode, "is not JSON" in done.stderr) == (2, True), done.stderr


def test_many_errors_of_one_kind_keep_their_lines(vdyn: Run, tmp_path: Path) -> None:
    runs = "".join(f"  - {{log: a{k}.csv, start: {k} kg}}\n" for k in range(6))
    (tmp_path / "t.yaml").write_text(f"test: tire\nruns:\n{runs}")
    done = vdyn("tire", tmp_path / "t.yaml", "-o", tmp_path / "out")
    assert done.returncode == 2
    assert all(f"t.yaml:{line}: " in done.stderr for line in range(3, 9)), done.stderr
