"""Collection of problems, so that all are reported at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from vdyn_cli.quantities.errors import Finding, InputError

P = ParamSpec("P")
R = TypeVar("R")


def attempt(problems: list[Finding], call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R | None:
    """The value of ``call(*args, **kwargs)``; None after an InputError, whose findings are added to ``problems``."""
    try:
        return call(*args, **kwargs)
    except InputError as error:
        problems.extend(f for f in error.findings if f not in problems)
        return None
