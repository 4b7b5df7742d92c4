"""The rooms and the direction of their arrows, read from the imports."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "vdyn_cli"

# A room may import those of its own row or of the rows above it.
ROWS = (
    ("quantities",),
    ("io", "description"),
    ("engine", "inference"),
    ("physics",),
    ("effects",),
    ("steps",),
    ("diagnosis",),
    ("project",),
    ("report", "export"),
    ("commands", "cli", "__main__"),
)
RANK = {room: row for row, rooms in enumerate(ROWS) for room in rooms}

# Each heavy library has one door.
DOORS = {
    "pandas": {"io"},
    "pint": {"quantities"},
    "casadi": {"engine"},
    "llvmlite": {"engine"},
    "matplotlib": {"report"},
    "jinja2": {"report"},
    "yaml": {"description"},
    "typer": {"cli"},
    "PIL": {"io"},
    "asammdf": {"io"},
    "pyarrow": {"io"},
    "h5py": {"io"},
}


MODULES = sorted(PACKAGE.rglob("*.py"))


def _room(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


def _imported(path: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module
            yield from (f"{node.module}.{alias.name}" for alias in node.names)


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_imports_run_one_way(path: Path) -> None:
    room = _room(path)
    if room == "__init__":
        return
    assert room in RANK, f"{path.name} lives in no room of the architecture"
    targets = {name.split(".")[1] for name in _imported(path) if name.startswith("vdyn_cli.")}
    wrong = {t for t in targets if t in RANK and RANK[t] > RANK[room]}
    assert not wrong, f"{room} must not import {wrong}"


@pytest.mark.parametrize("path", MODULES, ids=lambda p: str(p.relative_to(PACKAGE)))
def test_heavy_libraries_have_one_door(path: Path) -> None:
    room = _room(path)
    for name in _imported(path):
        doors = DOORS.get(name.split(".")[0])
        assert doors is None or room in doors, f"{room} imports {name}"


@pytest.mark.parametrize("path", sorted(PACKAGE.glob("steps/*/*.py")), ids=lambda p: f"{p.parent.name}/{p.name}")
def test_steps_do_not_import_each_other(path: Path) -> None:
    others = {p.parent.name for p in PACKAGE.glob("steps/*/step.py")} - {path.parent.name}
    wrong = [n for n in _imported(path) if n.startswith("vdyn_cli.steps.") and n.split(".")[2] in others]
    assert not wrong, f"{path.parent.name}/{path.name} imports {wrong}"


def test_effects_do_not_import_each_other() -> None:
    for path in (PACKAGE / "effects").glob("[a-z]*.py"):
        wrong = [n for n in _imported(path) if (PACKAGE / "effects" / f"{n.split('.')[-1]}.py").exists()]
        assert not [n for n in wrong if n.startswith("vdyn_cli.effects.")], f"{path.name} imports {wrong}"


def test_the_plant_shares_nothing_with_the_program() -> None:
    for path in (PACKAGE.parent / "tests" / "plant").rglob("*.py"):
        assert not [n for n in _imported(path) if n.startswith("vdyn_cli")], path.name
