"""The registry of steps: one folder each, found by name; importing this imports no step.

A step's folder holds ``step.py``, which defines ``STEP = Step(...)``; the first docstring line of its ``__init__.py``
is the command's help. Nothing else has to be touched to add one. An installed package adds a step by the entry point
``vdyn.steps: NAME = package.module:STEP``; the docstring of that module is its explanation.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from vdyn_cli.io.plugins import plugins
from vdyn_cli.steps.contract import Diagnosable, Failure, Problem, SimulatedProblem, Step, published, simulated

__all__ = [
    "Diagnosable",
    "Failure",
    "Problem",
    "SimulatedProblem",
    "Step",
    "explanation",
    "load_step",
    "names",
    "published",
    "simulated",
    "summary",
]

GROUP = "vdyn.steps"


def names() -> tuple[str, ...]:
    """The names of all steps, those of installed packages included, without importing them."""
    return tuple(sorted({*_built_in(), *plugins(GROUP)}))


def summary(name: str) -> str:
    """The first line of the step's docstring, read as text so that help stays instant."""
    if name in _built_in():
        with (Path(__file__).parent / name / "__init__.py").open(encoding="utf-8") as file:
            return file.readline().strip().strip('"').rstrip(".")
    plugin = plugins(GROUP)[name]
    return plugin.docstring().partition("\n")[0].rstrip(".") or f"A step of the package {plugin.package}"


def load_step(name: str) -> Step:
    """Import one step.

    Raises
    ------
    InputError : the step of an installed package cannot be imported, or is none; the message names the package.
    """
    if name in _built_in():
        step = import_module(f"vdyn_cli.steps.{name}.step").STEP
        assert isinstance(step, Step)
        return step
    plugin = plugins(GROUP)[name]
    step = plugin.load(Step)
    if step.name != name:
        plugin.refuse(f"holds a step of another name, {step.name!r}", "give both the same name")
    return step


def explanation(name: str) -> str:
    """The step's documentation: the docstring of its folder, or of the installed package's module."""
    if name in _built_in():
        return import_module(f"vdyn_cli.steps.{name}").__doc__ or ""
    return plugins(GROUP)[name].docstring()


def _built_in() -> frozenset[str]:
    return frozenset(p.parent.name for p in Path(__file__).parent.glob("*/step.py"))
