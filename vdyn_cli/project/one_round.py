"""All problems in one round: what is wrong is kept while the rest is read."""

from __future__ import annotations

from collections.abc import Callable
from typing import ParamSpec, TypeVar

from vdyn_cli.quantities.errors import Finding, InputError

P = ParamSpec("P")
R = TypeVar("R")


def attempt(problems: list[Finding], call: Callable[P, R], *args: P.args, **kwargs: P.kwargs) -> R | None:
    """Call, keeping what is wrong for one report at the end."""
    try:
        return call(*args, **kwargs)
    except InputError as error:
        problems.extend(f for f in error.findings if f not in problems)
        return None
