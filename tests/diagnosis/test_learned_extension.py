"""A learned formula is used where the fit without it misses the logs; a table only on request."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from vdyn_cli.diagnosis.extend.extension import _wanted

NAMES = {"formula": ("slope", "onset"), "table": tuple(f"knot_{k}" for k in range(15))}


@pytest.mark.parametrize(
    ("law", "extend", "misfit", "used"),
    [
        ("formula", "named", "the rms residual is 5 times the noise floor", True),
        ("formula", "named", "", False),
        ("table", "named", "the rms residual is 5 times the noise floor", False),
        ("table", "learned", "", True),
        ("formula", "never", "the rms residual is 5 times the noise floor", False),
    ],
)
def test_a_learned_law_is_used(law: str, extend: str, misfit: str, used: bool) -> None:
    candidates = {n: SimpleNamespace(unknowns=dict.fromkeys(unknowns)) for n, unknowns in NAMES.items()}
    setup: Any = SimpleNamespace(candidates=candidates, learned=frozenset(NAMES))
    judgment: Any = SimpleNamespace(answer=SimpleNamespace(effects=(law,)))
    base: Any = SimpleNamespace(refused=(), contradicted=False, fit=SimpleNamespace(misfit=misfit))
    assert _wanted(extend, setup, judgment, base) == ((law,) if used else ())
