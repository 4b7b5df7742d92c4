"""The rooms and the direction of their arrows, read from the imports."""

from __future__ import annotations

import ast
from collections.abc import Callable
from functools import cache
from pathlib import Path

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
    "nptdms": {"io"},
}


MODULES = sorted(PACKAGE.rglob("*.py"))


def _room(path: Path) -> str:
    return path.relative_to(PACKAGE).with_suffix("").parts[0]


@cache
def _imported(path: Path) -> tuple[str, ...]:
    found: list[str] = []
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found += (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            found += [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
    return tuple(found)


def _wrong(paths: list[Path], forbidden: Callable[[Path, str], bool]) -> list[str]:
    return [f"{p.relative_to(PACKAGE)} imports {n}" for p in paths for n in _imported(p) if forbidden(p, n)]


def test_every_module_lives_in_a_room() -> None:
    assert {_room(path) for path in MODULES} <= {*RANK, "__init__"}


def test_imports_run_one_way() -> None:
    def upward(path: Path, name: str) -> bool:
        target = name.split(".")[1] if name.startswith("vdyn_cli.") else ""
        return target in RANK and _room(path) in RANK and RANK[target] > RANK[_room(path)]

    assert _wrong(MODULES, upward) == []


def test_heavy_libraries_have_one_door() -> None:
    assert _wrong(MODULES, lambda path, name: _room(path) not in DOORS.get(name.split(".")[0], {_room(path)})) == []


def test_steps_do_not_import_each_other() -> None:
    steps = {p.parent.name for p in PACKAGE.glob("steps/*/step.py")}

    def another(path: Path, name: str) -> bool:
        own = path.relative_to(PACKAGE / "steps").parts[0]
        return name.startswith("vdyn_cli.steps.") and name.split(".")[2] in steps - {own}

    assert _wrong(sorted(PACKAGE.glob("steps/*/**/*.py")), another) == []


def test_effects_do_not_import_each_other() -> None:
    for path in (PACKAGE / "effects").glob("[a-z]*.py"):
        wrong = [n for n in _imported(path) if (PACKAGE / "effects" / f"{n.split('.')[-1]}.py").exists()]
        assert not [n for n in wrong if n.startswith("vdyn_cli.effects.")], f"{path.name} imports {wrong}"


def test_the_plant_shares_nothing_with_the_program() -> None:
    for path in (PACKAGE.parent / "tests" / "plant").rglob("*.py"):
        assert not [n for n in _imported(path) if n.startswith("vdyn_cli")], path.name
