"""The registry of steps: each is a folder found by its name; importing the registry imports no step.

A step's folder contains ``step.py``, which defines ``STEP = Step(...)``; the first docstring line of its
``__init__.py`` is the command's help. Adding a step requires no other change. An installed package adds a step with the
entry point ``vdyn.steps: NAME = package.module:STEP``; the docstring of that module is its explanation.
"""

from __future__ import annotations

from importlib import import_module
from pathlib import Path

from vdyn_cli.io.plugins import plugins
from vdyn_cli.steps.added_effects import NO_EFFECTS, AddedEffects
from vdyn_cli.steps.contract import Problem, SimulatedProblem
from vdyn_cli.steps.failure import Failure, published
from vdyn_cli.steps.step_definition import Diagnosable, Step, simulated_problem

__all__ = [
    "NO_EFFECTS",
    "AddedEffects",
    "Diagnosable",
    "Failure",
    "Problem",
    "SimulatedProblem",
    "Step",
    "explanation",
    "load_step",
    "names",
    "published",
    "simulated_problem",
    "summary",
]

GROUP = "vdyn.steps"


def names() -> tuple[str, ...]:
    """The names of all steps, including those of installed packages, without importing them."""
    return tuple(sorted({*_built_in(), *plugins(GROUP)}))


def summary(name: str) -> str:
    """The first line of the step's docstring, read as text so that help needs no import."""
    if name in _built_in():
        with (Path(__file__).parent / name / "__init__.py").open(encoding="utf-8") as file:
            return file.readline().strip().strip('"').rstrip(".")
    plugin = plugins(GROUP)[name]
    return plugin.docstring().partition("\n")[0].rstrip(".") or f"A step of the package {plugin.package}"


def load_step(name: str) -> Step:
    """Import one step.

    Raises
    ------
    InputError : the step of an installed package cannot be imported, or is not a Step; the message names the package.
    """
    if name in _built_in():
        step = import_module(f"vdyn_cli.steps.{name}.step").STEP
        assert isinstance(step, Step)
        return step
    plugin = plugins(GROUP)[name]
    step = plugin.load(Step)
    if step.name != name:
        plugin.refuse(f"defines a step with a different name, {step.name!r}", "give both the same name")
    return step


def explanation(name: str) -> str:
    """The step's documentation: the docstring of its folder, or of the installed package's module."""
    if name in _built_in():
        return import_module(f"vdyn_cli.steps.{name}").__doc__ or ""
    return plugins(GROUP)[name].docstring()


def _built_in() -> frozenset[str]:
    return frozenset(p.parent.name for p in Path(__file__).parent.glob("*/step.py"))
