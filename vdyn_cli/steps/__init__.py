"""The registry of steps: one folder each, found by name; importing this imports no step.

A step's folder holds ``step.py``, which defines ``STEP = Step(...)``; the first docstring line of its ``__init__.py``
is the command's help. Nothing else has to be touched to add one.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from vdyn_cli.steps.contract import Diagnosable, Failure, Problem, Step, published

__all__ = ["Diagnosable", "Failure", "Problem", "Step", "explanation", "load_step", "names", "published", "summary"]


def names() -> tuple[str, ...]:
    """The names of all steps, without importing them."""
    return tuple(sorted(p.parent.name for p in Path(__file__).parent.glob("*/step.py")))


def summary(name: str) -> str:
    """The first line of the step's docstring, read as text so that help stays instant."""
    with (Path(__file__).parent / name / "__init__.py").open(encoding="utf-8") as file:
        return file.readline().strip().strip('"').rstrip(".")


def load_step(name: str) -> Step:
    """Import one step."""
    step = import_module(f"vdyn_cli.steps.{name}.step").STEP
    assert isinstance(step, Step)
    return step


def explanation(name: str) -> str:
    """The step's documentation: the docstring of its folder."""
    return import_module(f"vdyn_cli.steps.{name}").__doc__ or ""
