"""Plug-ins: effects, steps and readers of installed packages (entry points ``vdyn.effects``, ``.steps``, ``.readers``).

A package is imported only when it is used, so that ``vdyn --help`` stays fast and a broken package affects only its own
commands.
"""

from __future__ import annotations

import sys
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from importlib.metadata import EntryPoint, entry_points
from pathlib import Path
from types import MappingProxyType
from typing import NoReturn, TypeVar

from vdyn_cli.quantities.errors import Finding, InputError

T = TypeVar("T")


@dataclass(frozen=True)
class Plugin:
    """One entry point of an installed package: ``NAME = package.module:OBJECT``."""

    entry: EntryPoint

    @property
    def name(self) -> str:
        """The name under which vdyn knows it."""
        return self.entry.name

    @property
    def package(self) -> str:
        """The name of the installed package."""
        return self.entry.dist.name if self.entry.dist else self.entry.module

    def load(self, kind: type[T]) -> T:
        """Import the object.

        Raises
        ------
        InputError : it cannot be imported or is not a ``kind``; the message names the package.
        """
        try:
            found = self.entry.load()
        except Exception as error:  # any exception of a foreign module is an error of its package
            self.refuse(
                f"cannot be imported ({type(error).__name__}: {error})", f"repair or uninstall {self.package}", error
            )
        if not isinstance(found, kind):
            self.refuse(f"is a {type(found).__name__}, not a {kind.__name__}", f"repair or uninstall {self.package}")
        return found

    def refuse(self, what: str, remedy: str, error: Exception | None = None) -> NoReturn:
        """Raise an InputError that names the package, the problem ``what`` and the remedy."""
        where = f"package {self.package}, plug-in {self.name} ({self.entry.value})"
        raise InputError(Finding(where, what, remedy=remedy)) from error

    def docstring(self) -> str:
        """The docstring of its module, read from the file without importing it; empty if there is no such file."""
        import ast

        path = _source_file(self.entry.module)
        try:
            return (ast.get_docstring(ast.parse(path.read_text(encoding="utf-8"))) or "") if path else ""
        except (OSError, SyntaxError, ValueError):
            return ""


def plugins(group: str) -> Mapping[str, Plugin]:
    """The plug-ins of one group by name, sorted by name; of two with one name, that of the first package."""
    return _installed(group, tuple(sys.path))


@lru_cache(maxsize=16)  # reading the metadata of all installed packages takes 7 ms, for every log file
def _installed(group: str, path: tuple[str, ...]) -> Mapping[str, Plugin]:
    """The plug-ins of one group on an import path."""
    found: dict[str, Plugin] = {}
    for plugin in sorted(map(Plugin, entry_points(group=group)), key=lambda p: (p.name, p.package)):
        found.setdefault(plugin.name, plugin)
    return MappingProxyType(found)


def _source_file(module: str) -> Path | None:
    """The file of a module, located part by part, since importlib's find_spec would import every parent."""
    path, name, origin = None, "", None
    for part in module.split("."):
        name = f"{name}.{part}" if name else part
        specs = (finder.find_spec(name, path, None) for finder in sys.meta_path)
        spec = next((s for s in specs if s is not None), None)
        if spec is None:
            return None
        path, origin = spec.submodule_search_locations, spec.origin
    return Path(origin) if origin and origin.endswith(".py") else None
