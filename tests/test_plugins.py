"""An installed package adds an effect, a step and a log format without a change of vdyn: run as a user runs it."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import tomllib
from collections.abc import Callable
from pathlib import Path

import jsonschema
import pytest
import yaml

EXAMPLE = Path(__file__).parent / "plugin_example"
RUN = "import sys; from vdyn_cli.cli import main; sys.argv[0] = 'vdyn'; main()"
HEAVY = "numpy pandas scipy matplotlib casadi llvmlite pint pydantic jinja2 yaml spin_down"

Vdyn = Callable[..., subprocess.CompletedProcess[str]]


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


@pytest.fixture(scope="module")
def vdyn(site: Path, root: Path) -> Vdyn:
    def run(*arguments: object, sites: tuple[Path, ...] = (site,), code: str = RUN) -> subprocess.CompletedProcess[str]:
        environment = {**os.environ, "PYTHONPATH": os.pathsep.join(map(str, (root, *sites)))}
        command = [sys.executable, "-c", code, *map(str, arguments)]
        return subprocess.run(command, cwd=root, env=environment, capture_output=True, text=True, timeout=120)

    return run


@pytest.fixture(scope="module")
def result(vdyn: Vdyn, tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("out")
    done = vdyn("spindown", EXAMPLE / "spindown.yaml", "-o", folder)
    assert done.returncode == 0, done.stderr
    return folder


def test_help_lists_the_step_without_importing_it(vdyn: Vdyn) -> None:
    code = (
        "import sys; sys.argv = ['vdyn', '--help']\n"
        "from vdyn_cli.cli import main\n"
        "try: main()\n"
        "except SystemExit as e: assert not e.code, e.code\n"
        f"loaded = set('{HEAVY}'.split()) & set(sys.modules)\n"
        "assert not loaded, loaded\n"
    )
    done = vdyn(code=code)
    assert done.returncode == 0, done.stderr
    assert "Bearing friction torque from a wheel that" in done.stdout


def test_the_step_has_a_command_an_explanation_and_a_schema(vdyn: Vdyn) -> None:
    assert "TEST.yaml" in vdyn("spindown", "--help").stdout
    assert "Newton's second law" in vdyn("explain", "spindown").stdout
    schema = json.loads(vdyn("schema", "spindown").stdout)
    jsonschema.validate(yaml.safe_load((EXAMPLE / "spindown.yaml").read_text()), schema)


def test_effect_and_step_are_listed_and_explained(vdyn: Vdyn) -> None:
    listed = vdyn("list").stdout
    assert "seal_drag                a seal that drags with speed: spindown" in listed
    assert "spindown   Bearing friction torque" in listed
    explained = vdyn("explain", "seal_drag").stdout
    assert "candidate in: spindown" in explained
    assert "T = T0 + c om." in explained


def test_the_step_reads_the_format_and_the_diagnosis_names_the_effect(result: Path) -> None:
    document = json.loads((result / "spindown.json").read_text())
    diagnosis = document["diagnosis"]
    assert (diagnosis["verdict"], diagnosis["extended"]) == ("named", ["seal_drag"])
    low, high = diagnosis["causes"][0]["unknowns"]["seal_drag"]["interval95"]
    assert low < 0.012 < high  # N m s/rad, with which the recordings were made
    low, high = document["parameters"]["spin_torque"]["interval95"]
    assert low < 0.35 < high  # N m
    assert set(document["provenance"]["inputs"]) == {"spindown.yaml", "spin_1.spin", "spin_2.spin"}


def test_the_report_has_the_effect_by_its_label(result: Path) -> None:
    page = (result / "spindown.html").read_text()
    assert "a seal that drags with speed" in page.lower()
    assert "spin_1.spin" in page


@pytest.mark.parametrize("name", ["seal_drag", "spindown", "spinlog"])
def test_each_keeps_its_contract(name: str, vdyn: Vdyn) -> None:
    done = vdyn("test-plugin", name, EXAMPLE / ("spin_1.spin" if name == "spinlog" else "spindown.yaml"))
    assert done.returncode == 0, done.stderr + done.stdout
    assert len(done.stdout.splitlines()) >= 5


def test_a_broken_contract_is_exit_1_and_says_which(tmp_path: Path, vdyn: Vdyn) -> None:
    install(tmp_path, EXAMPLE)
    file = tmp_path / "spin_down" / "seal_drag.py"
    file.write_text(
        file.read_text().replace("+ q.seal_drag *", "+ (0.01 + q.seal_drag) *").replace("free_spin", "moon")
    )
    done = vdyn("test-plugin", "seal_drag", EXAMPLE / "spindown.yaml", sites=(tmp_path,))
    assert done.returncode == 1, done.stderr
    assert "tags are known: moon: neither a property nor the situation of an installed step" in done.stderr
    assert "nothing at zero: spin down: changes the rates of the states at zero" in done.stderr
    assert "effect seal_drag: units and ranges: passed" in done.stdout


@pytest.fixture
def broken(tmp_path: Path) -> Path:
    """A package whose three modules raise when they are imported."""
    (tmp_path / "ruin.py").write_text('"""A step that cannot be imported."""\nimport no_such_library\n')
    names = {"vdyn.steps": "ruinstep", "vdyn.effects": "ruineffect", "vdyn.readers": "ruinreader"}
    metadata(tmp_path, "vdyn-ruin", {group: {name: "ruin:X"} for group, name in names.items()})
    return tmp_path


def test_a_broken_package_is_named_and_stops_no_other_command(broken: Path, tmp_path: Path, vdyn: Vdyn) -> None:
    def told(*arguments: object) -> tuple[int, str]:
        done = vdyn(*arguments, sites=(broken,))
        assert "Traceback" not in done.stderr
        return done.returncode, done.stdout + done.stderr

    code, text = told("--help")
    assert (code, "A step that cannot be imported" in text) == (0, True)
    code, text = told("list")
    assert (code, "package vdyn-ruin, plug-in ruineffect (ruin:X): cannot be imported" in text) == (0, True)
    code, text = told("tire", "configs/tire.yaml", "-o", tmp_path / "out")
    assert (code, "package vdyn-ruin, plug-in ruineffect" in text) == (0, True)
    for arguments in (("ruinstep", "configs/tire.yaml"), ("explain", "ruineffect"), ("test-plugin", "ruinreader", "x")):
        code, text = told(*arguments)
        assert (code, "package vdyn-ruin" in text) == (2, True), text


def test_a_step_or_effect_with_the_name_of_another_is_refused(tmp_path: Path, vdyn: Vdyn) -> None:
    install(tmp_path, EXAMPLE)
    metadata(tmp_path, "vdyn-twice", {"vdyn.effects": {"headwind": "spin_down.seal_drag:seal_drag"}})
    listed = vdyn("list", sites=(tmp_path,)).stdout
    assert "package vdyn-twice, plug-in headwind (spin_down.seal_drag:seal_drag): holds an effect of another" in listed
    assert listed.count("  headwind ") == 1
