"""An installed package adds an effect, a step and a log format without a change of vdyn: run as a user runs it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import jsonschema
import pytest
import yaml

EXAMPLE = Path(__file__).parent / "plugin_example"
# Several commands one after another in one process, as a shell would start them: exit code, stdout and stderr of each.
RUN = """
import contextlib, io, json, sys
from vdyn_cli.cli import main
for arguments in json.loads(sys.argv[1]):
    sys.argv = ["vdyn", *arguments]
    code, out, error = 0, io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(error):
        try:
            main()
        except SystemExit as ended:
            code = ended.code or 0
    print(json.dumps([code, out.getvalue(), error.getvalue()]))
"""
HEAVY = "numpy pandas scipy matplotlib casadi llvmlite pint pydantic jinja2 yaml spin_down"

Said = tuple[int, str, str]


def process(root: Path, sites: tuple[Path, ...], code: str, *arguments: str) -> subprocess.CompletedProcess[str]:
    environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (root, *sites)))}
    command = [sys.executable, "-c", code, *arguments]
    return subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, timeout=120)


def vdyn(root: Path, site: Path, *commands: tuple[object, ...]) -> list[Said]:
    """What commands end with and say where the packages of a folder are installed."""
    done = process(root, (site,), RUN, json.dumps([[str(a) for a in command] for command in commands]))
    assert done.returncode == 0, done.stderr
    return [(code, out, error) for code, out, error in map(json.loads, done.stdout.splitlines())]


def install(site: Path, project: Path) -> None:
    """Copy a package to a folder with the metadata that pip would write of its pyproject.toml; needs no network."""
    described = tomllib.loads((project / "pyproject.toml").read_text())
    for package in described["tool"]["setuptools"]["packages"]:
        shutil.copytree(project / package, site / package)
    metadata(site, described["project"]["name"], described["project"]["entry-points"])


def metadata(site: Path, name: str, entry_points: dict[str, dict[str, str]]) -> None:
    info = site / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n")
    groups = (f"[{group}]\n" + "".join(f"{n} = {v}\n" for n, v in of.items()) for group, of in entry_points.items())
    (info / "entry_points.txt").write_text("\n".join(groups))


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("site")
    install(folder, EXAMPLE)
    return folder


COMMANDS: dict[str, tuple[object, ...]] = {
    "help": ("spindown", "--help"),
    "explain spindown": ("explain", "spindown"),
    "schema": ("schema", "spindown"),
    "list": ("list",),
    "explain seal_drag": ("explain", "seal_drag"),
    "seal_drag": ("test-plugin", "seal_drag", EXAMPLE / "spindown.yaml"),
    "spindown": ("test-plugin", "spindown", EXAMPLE / "spindown.yaml"),
    "spinlog": ("test-plugin", "spinlog", EXAMPLE / "spin_1.spin"),
}


@pytest.fixture(scope="module")
def result(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The folder that the plugged-in step writes to."""
    return tmp_path_factory.mktemp("out")


@pytest.fixture(scope="module")
def said(root: Path, site: Path, result: Path) -> dict[str, Said]:
    """What each command says with the package installed, all of one process."""
    commands = {**COMMANDS, "run": ("spindown", EXAMPLE / "spindown.yaml", "-o", result)}
    return dict(zip(commands, vdyn(root, site, *commands.values()), strict=True))


def test_help_lists_the_step_without_importing_it(root: Path, site: Path) -> None:
    code = (
        "import sys; sys.argv = ['vdyn', '--help']\n"
        "from vdyn_cli.cli import main\n"
        "try: main()\n"
        "except SystemExit as e: assert not e.code, e.code\n"
        f"loaded = set('{HEAVY}'.split()) & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    done = process(root, (site,), code)
    assert done.returncode == 0, done.stderr
    assert "Bearing friction torque from a wheel that" in done.stdout


def test_the_step_has_a_command_an_explanation_and_a_schema(said: dict[str, Said]) -> None:
    assert "TEST.yaml" in said["help"][1]
    assert "Newton's second law" in said["explain spindown"][1]
    jsonschema.validate(yaml.safe_load((EXAMPLE / "spindown.yaml").read_text()), json.loads(said["schema"][1]))


def test_effect_and_step_are_listed_and_explained(said: dict[str, Said]) -> None:
    listed = said["list"][1]
    assert "seal_drag                a seal that drags with speed: spindown" in listed
    assert "spindown   Bearing friction torque" in listed
    explained = said["explain seal_drag"][1]
    assert "candidate in: spindown" in explained
    assert "T = T0 + c om." in explained


def test_the_step_reads_the_format_and_the_diagnosis_names_the_effect(said: dict[str, Said], result: Path) -> None:
    assert said["run"][0] == 0, said["run"]
    document = json.loads((result / "spindown.json").read_text())
    diagnosis = document["diagnosis"]
    assert (diagnosis["verdict"], diagnosis["extended"]) == ("named", ["seal_drag"])
    low, high = diagnosis["causes"][0]["unknowns"]["seal_drag"]["interval95"]
    assert low < 0.012 < high  # N m s/rad, with which the recordings were made
    low, high = document["parameters"]["spin_torque"]["interval95"]
    assert low < 0.35 < high  # N m
    assert set(document["provenance"]["inputs"]) == {"spindown.yaml", "spin_1.spin", "spin_2.spin"}


def test_the_report_has_the_effect_by_its_label(said: dict[str, Said], result: Path) -> None:
    assert said["run"][0] == 0
    page = (result / "spindown.html").read_text()
    assert "a seal that drags with speed" in page.lower()
    assert "spin_1.spin" in page


@pytest.mark.parametrize("name", ["seal_drag", "spindown", "spinlog"])
def test_each_keeps_its_contract(name: str, said: dict[str, Said]) -> None:
    code, out, error = said[name]
    assert code == 0, error + out
    assert len(out.splitlines()) >= 5


@pytest.mark.slow  # a contract test in a process of its own
def test_a_broken_contract_is_exit_1_and_says_which(tmp_path: Path, root: Path) -> None:
    install(tmp_path, EXAMPLE)
    file = tmp_path / "spin_down" / "seal_drag.py"
    file.write_text(
        file.read_text().replace("+ q.seal_drag *", "+ (0.01 + q.seal_drag) *").replace("free_spin", "moon")
    )
    ((code, out, error),) = vdyn(root, tmp_path, ("test-plugin", "seal_drag", EXAMPLE / "spindown.yaml"))
    assert code == 1, error
    assert "tags are known: moon: neither a property nor the situation of an installed step" in error
    assert "nothing at zero: spin down: changes the rates of the states at zero" in error
    assert "effect seal_drag: units and ranges: passed" in out


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    """A package whose three modules raise when they are imported, and one with an effect under another's name."""
    install(tmp_path, EXAMPLE)
    (tmp_path / "ruin.py").write_text('"""A step that cannot be imported."""\nimport no_such_library\n')
    names = {"vdyn.steps": "ruinstep", "vdyn.effects": "ruineffect", "vdyn.readers": "ruinreader"}
    metadata(tmp_path, "vdyn-ruin", {group: {name: "ruin:X"} for group, name in names.items()})
    metadata(tmp_path, "vdyn-twice", {"vdyn.effects": {"headwind": "spin_down.seal_drag:seal_drag"}})
    return tmp_path


@pytest.mark.slow  # six processes
def test_a_broken_package_is_named_and_stops_no_other_command(broken: Path, tmp_path: Path, root: Path) -> None:
    refused = (("ruinstep", "configs/tire.yaml"), ("explain", "ruineffect"), ("test-plugin", "ruinreader", "x"))
    tire = ("tire", "configs/tire.yaml", "--no-diagnose", "-o", tmp_path / "out")
    said = vdyn(root, broken, ("--help",), ("list",), tire, *refused)
    assert not any("Traceback" in error for _, _, error in said)
    (code, text), listed, run, *others = [(code, out + error) for code, out, error in said]
    assert (code, "A step that cannot be imported" in text) == (0, True)
    taken = "package vdyn-twice, plug-in headwind (spin_down.seal_drag:seal_drag): defines an effect with a different"
    for code, text in (listed, run):
        assert (code, "package vdyn-ruin, plug-in ruineffect (ruin:X): cannot be imported" in text) == (0, True), text
        assert taken in text
    for code, text in others:
        assert (code, "package vdyn-ruin" in text) == (2, True), text
    assert said[1][1].count("  headwind ") == 1  # the other effect of this name is left as it was
