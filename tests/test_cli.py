"""The command line as a user meets it: help, exit codes, clear messages, whole files."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import jsonschema
import pytest
import yaml
from typer.testing import CliRunner

from vdyn_cli import steps
from vdyn_cli.cli import app

RUN = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"


@pytest.fixture(scope="module")
def vdyn(root: Path):  # type: ignore[no-untyped-def]
    def run(*arguments: object, folder: Path = root) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": str(root)}
        command = [sys.executable, "-c", RUN, *map(str, arguments)]
        return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, timeout=120)

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
        jsonschema.validate({**sample, "unknown_key": 1}, schema)


def test_the_steps_give_the_json_on_stdout_alone(vdyn) -> None:  # type: ignore[no-untyped-def]
    done = vdyn("tire", "configs/tire.yaml", "-o", "-", "-q")
    assert done.returncode == 0, done.stderr
    document = json.loads(done.stdout)
    assert document["format"] == "vdyn/parameters/1"
    assert set(document) >= {"step", "parameters", "correlation", "fit", "diagnosis", "provenance"}
    assert set(document["parameters"]["tire_D"]) == {
        *("value", "std", "interval95", "unit", "meaning", "baseline", "source"),
    }
    assert done.stderr == ""


def test_same_inputs_give_the_same_bytes(vdyn, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    for folder in ("a", "b"):
        assert vdyn("inertia", "configs/inertia.yaml", "-o", tmp_path / folder).returncode == 0
    for name in ("inertia.json", "inertia.html"):
        assert (tmp_path / "a" / name).read_bytes() == (tmp_path / "b" / name).read_bytes()


BAD = {
    "no such file": ("nowhere.yaml", None, "does not exist"),
    "another test": ("t.yaml", "test: bump\n", "test type mismatch"),
    "unknown key": ("t.yaml", "test: tire\nchanels: {}\n", "did you mean channels"),
    "unknown channel": ("t.yaml", "test: tire\nchannels: {sped: {column: a, unit: m/s}}\n", "unknown channel 'sped'"),
    "no channels": ("t.yaml", "test: tire\nruns: [{log: a.csv}]\n", "channel force_x is needed"),
    "no runs": ("t.yaml", "test: tire\n", "no slip sweep"),
    "not YAML": ("t.yaml", "test: [tire\n", "not valid YAML"),
}


@pytest.mark.parametrize("case", BAD)
def test_wrong_input_is_exit_2_one_message_and_no_file(case: str, vdyn, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    name, text, says = BAD[case]
    if text is not None:
        (tmp_path / name).write_text(text)
    done = vdyn("tire", name, "-o", "out", folder=tmp_path)
    assert done.returncode == 2, done.stderr
    assert says in done.stderr
    assert "Traceback" not in done.stderr
    assert not (tmp_path / "out").exists()


def test_an_answer_that_is_not_good_is_exit_1_with_a_report_and_the_old_json(vdyn, tmp_path: Path, root: Path) -> None:  # type: ignore[no-untyped-def]
    text = (root / "configs" / "cg.yaml").read_text().replace("../sample_logs", str(root / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", "vehicle: {mass: 1588 kg, wheelbase: 2.7 m, antenna_height: 0.05 m}")
    text = text.replace('column: "Pitch Rate [deg/s]", unit: deg/s', 'column: "Pitch Rate [deg/s]", unit: rad/s')
    (tmp_path / "cg.yaml").write_text(text)
    (tmp_path / "out").mkdir()
    (tmp_path / "out" / "cg.json").write_text("older and good")
    done = vdyn("cg", "cg.yaml", folder=tmp_path)
    assert done.returncode in (1, 2), done.stderr
    assert "Traceback" not in done.stderr
    assert (tmp_path / "out" / "cg.json").read_text() == "older and good"
    if done.returncode == 1:
        assert (tmp_path / "out" / "cg.html").exists()


def test_usage_errors_and_unknown_topics(vdyn) -> None:  # type: ignore[no-untyped-def]
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


def test_a_known_file_that_is_none_is_refused(vdyn, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "k.json").write_text("{")
    done = vdyn("tire", "configs/tire.yaml", "--known", tmp_path / "k.json", "-o", tmp_path / "out")
    assert (done.returncode, "is not JSON" in done.stderr) == (2, True), done.stderr


def test_many_errors_of_one_kind_keep_their_lines(vdyn, tmp_path: Path) -> None:  # type: ignore[no-untyped-def]
    runs = "".join(f"  - {{log: a{k}.csv, start: {k} kg}}\n" for k in range(6))
    (tmp_path / "t.yaml").write_text(f"test: tire\nruns:\n{runs}")
    done = vdyn("tire", tmp_path / "t.yaml", "-o", tmp_path / "out")
    assert done.returncode == 2
    assert all(f"t.yaml:{line}: " in done.stderr for line in range(3, 9)), done.stderr
