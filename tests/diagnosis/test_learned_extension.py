"""A learned formula is used where it is certain, or the result without it misses the logs; a table on request."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from vdyn_cli.diagnosis.extend.extension import _wanted

NAMES = {"formula": ("height", "exponent"), "table": tuple(f"knot_{k}" for k in range(15))}
NUMBER = SimpleNamespace(unit="N m", meaning="")
CANDIDATES = {
    n: SimpleNamespace(name=n, unknowns=dict.fromkeys(unknowns, NUMBER), nominal={"exponent": 3.0})
    for n, unknowns in NAMES.items()
}
SETUP: Any = SimpleNamespace(candidates=CANDIDATES, learned=frozenset({"formula", "table"}))
FAR, NEAR = 7.0, 5.0  # standard errors of the amplitude


@pytest.mark.parametrize(
    ("law", "extend", "misfit", "sufficient", "height", "used"),
    [
        ("formula", "named", "the rms residual is 5 times the noise floor", False, NEAR, True),
        ("formula", "named", "", True, FAR, True),
        ("formula", "named", "", True, NEAR, False),
        ("formula", "named", "", False, FAR, False),
        ("table", "named", "the rms residual is 5 times the noise floor", True, FAR, False),
        ("table", "learned", "", False, NEAR, True),
        ("formula", "never", "the rms residual is 5 times the noise floor", True, FAR, False),
    ],
)
def test_a_learned_law_is_used(law: str, extend: str, misfit: str, sufficient: bool, height: float, used: bool) -> None:
    """An exponent that is certain does not make a formula certain."""
    values = {n: 100.0 if n == "exponent" else height for n in NAMES[law]}
    ones = dict.fromkeys(values, 1.0)
    solution = SimpleNamespace(values=values, std=ones, interval95=dict.fromkeys(values, (0.0, 1.0)))
    answer = SimpleNamespace(effects=(law,), sufficient=sufficient, fitted=SimpleNamespace(solution=solution))
    judgment: Any = SimpleNamespace(answer=answer)
    base: Any = SimpleNamespace(refused=(), contradicted=False, fit=SimpleNamespace(misfit=misfit))
    assert _wanted(extend, SETUP, judgment, base) == ((law,) if used else ())
