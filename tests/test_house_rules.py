"""The rules that keep the code readable for a stranger, read from the source itself."""

from __future__ import annotations

import ast
from collections import defaultdict
from functools import cache
from pathlib import Path

import pytest

PACKAGE = Path(__file__).resolve().parent.parent / "vdyn_cli"
LONGEST_FUNCTION, MOST_METHODS, MOST_PARAMETERS = 70, 15, 6
FORBIDDEN = {"words", "views", "given", "loose", "thin", "sizes", "level", "nearer", "utils", "misc"}
MODULES = sorted(PACKAGE.rglob("*.py"))

Function = ast.FunctionDef | ast.AsyncFunctionDef


@cache
def _tree(path: Path) -> ast.Module:
    return ast.parse(path.read_text(encoding="utf-8"))


@cache
def _nodes(path: Path) -> tuple[ast.AST, ...]:
    return tuple(ast.walk(_tree(path)))


def _has_reason(lines: list[str], node: Function) -> bool:
    """Whether a comment directly above the definition says why it has so many parameters."""
    first = min([node.lineno, *(d.lineno for d in node.decorator_list)])
    return first > 1 and lines[first - 2].lstrip().startswith("#")


def test_functions_and_classes_stay_small() -> None:
    assert [wrong for path in MODULES for wrong in _too_large(path)] == []


def _too_large(path: Path) -> list[str]:
    lines, wrong = path.read_text(encoding="utf-8").splitlines(), []
    for node in _nodes(path):
        if isinstance(node, Function):
            length = (node.end_lineno or node.lineno) - node.lineno + 1
            if length > LONGEST_FUNCTION:
                wrong.append(f"{path}: {node.name} has {length} lines")
            every = [a.arg for a in (*node.args.posonlyargs, *node.args.args, *node.args.kwonlyargs)]
            many = [a for a in every if a not in ("self", "cls")]
            if len(many) > MOST_PARAMETERS and not _has_reason(lines, node):
                wrong.append(f"{path}: {node.name} has {len(many)} parameters and no comment above says why")
        elif isinstance(node, ast.ClassDef):
            methods = [n for n in node.body if isinstance(n, Function)]
            if len(methods) > MOST_METHODS:
                wrong.append(f"{path}: class {node.name} has {len(methods)} methods")
    return wrong


def test_public_functions_have_a_docstring() -> None:
    assert {path: names for path in MODULES if (names := _undocumented(path))} == {}


def _undocumented(path: Path) -> list[str]:
    tree = _tree(path)
    public = [n for n in tree.body if isinstance(n, ast.ClassDef) and not n.name.startswith("_")]
    functions = [n for body in (tree.body, *(c.body for c in public)) for n in body if isinstance(n, Function)]
    return [n.name for n in functions if not n.name.startswith("_") and ast.get_docstring(n) is None]


def test_no_two_classes_have_one_name() -> None:
    owners: dict[str, list[str]] = defaultdict(list)
    for path in MODULES:
        for node in _nodes(path):
            if isinstance(node, ast.ClassDef):
                owners[node.name].append(str(path.relative_to(PACKAGE)))
    assert {n: p for n, p in owners.items() if len(p) > 1} == {}


def test_no_two_modules_have_one_name_outside_the_step_folders() -> None:
    owners: dict[str, list[str]] = defaultdict(list)
    for path in MODULES:
        parts = path.relative_to(PACKAGE).parts
        if path.stem != "__init__" and not (parts[0] == "steps" and len(parts) > 2):
            owners[path.stem].append("/".join(parts))
    assert {n: p for n, p in owners.items() if len(p) > 1} == {}


def test_modules_are_named_after_what_they_hold() -> None:
    assert [str(p.relative_to(PACKAGE)) for p in MODULES if p.stem in FORBIDDEN] == []


@pytest.mark.parametrize("room", ["steps", "diagnosis", "project", "report", "export", "commands"])
def test_rooms_that_ask_keep_no_results_in_modules(room: str) -> None:
    """Results of a fit or a preparation belong to the problem, not to a module (templates and catalogs may be)."""
    found = []
    for path in sorted((PACKAGE / room).rglob("*.py")):
        text = path.read_text(encoding="utf-8")
        found += [f"{path.relative_to(PACKAGE)}: lru_cache" for _ in range(text.count("lru_cache"))]
    assert found == []


def test_percent_stands_apart_from_its_number() -> None:
    """As every unit does (ISO 80000-1)."""
    wrong = [
        f"{path.relative_to(PACKAGE)}:{node.lineno}"
        for path in MODULES
        for node in _nodes(path)
        if isinstance(node, ast.FormattedValue) and node.format_spec is not None
        for part in ast.walk(node.format_spec)
        if isinstance(part, ast.Constant) and str(part.value).endswith("%")
    ]
    assert not wrong


@pytest.mark.parametrize("room", ["steps", "diagnosis", "effects"])
def test_numbers_that_judge_have_a_reason_beside_them(room: str) -> None:
    """Those that change a verdict stand in a policy; of the others a comment says what they are."""
    wrong = []
    for path in sorted((PACKAGE / room).rglob("*.py")):
        lines = path.read_text(encoding="utf-8").splitlines()
        for node in _tree(path).body:
            if isinstance(node, ast.Assign) and _is_number(node.value) and not lines[node.lineno - 2].startswith("#"):
                wrong += [f"{path.relative_to(PACKAGE)}:{node.lineno}"] if "#" not in lines[node.lineno - 1] else []
    assert wrong == []


def _is_number(value: ast.expr) -> bool:
    if isinstance(value, ast.Tuple):
        return all(_is_number(v) for v in value.elts)
    plain = value.operand if isinstance(value, ast.UnaryOp) else value
    return isinstance(plain, ast.Constant) and type(plain.value) in (int, float)
