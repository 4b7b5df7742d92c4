"""A learned formula is used where the result without it misses the logs or is undetermined; a table on request."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import pytest

from vdyn_cli.diagnosis import diagnose
from vdyn_cli.diagnosis.extend.extension import Extension, _wanted
from vdyn_cli.quantities.parameters import Estimate, Parameters
from vdyn_cli.quantities.result import FitSummary, Result

NAMES = {"formula": ("slope", "onset"), "table": tuple(f"knot_{k}" for k in range(15)), "catalog": ("drag",)}
CANDIDATES = {n: SimpleNamespace(unknowns=dict.fromkeys(unknowns)) for n, unknowns in NAMES.items()}
SETUP: Any = SimpleNamespace(candidates=CANDIDATES, learned=frozenset({"formula", "table"}))


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
    judgment: Any = SimpleNamespace(answer=SimpleNamespace(effects=(law,)))
    base: Any = SimpleNamespace(refused=(), contradicted=False, fit=SimpleNamespace(misfit=misfit))
    assert _wanted(extend, SETUP, judgment, base) == ((law,) if used else ())


@pytest.mark.parametrize(
    ("law", "extend", "without", "with_it", "used"),
    [
        ("formula", "named", 6000.0, 400.0, True),
        ("formula", "named", 400.0, 200.0, False),
        ("formula", "named", 6000.0, 7000.0, False),
        ("formula", "never", 6000.0, 400.0, False),
        ("table", "named", 6000.0, 400.0, False),
        ("catalog", "named", 6000.0, 400.0, False),
    ],
)
def test_a_formula_is_used_where_no_parameter_is_determined_without_it(
    monkeypatch: pytest.MonkeyPatch, law: str, extend: str, without: float, with_it: float, used: bool
) -> None:
    def published(strategy: Any, judgment: Any, extension: Extension, *others: Any) -> Result:
        half = with_it if extension.effects else without
        stiffness = Estimate.of("shaft_stiffness_left", 5000.0, half / 2, (5000.0 - half, 5000.0 + half), "shaft")
        mass = Estimate.of("mass", 1500.0, 1.0, (1498.0, 1502.0), "given")
        fit = FitSummary(runs=1, rms=1.0, unit="N m", noise_floor=1.0, unknowns=())
        return Result("shaft", "", Parameters({"shaft_stiffness_left": stiffness, "mass": mass}), fit, "")

    def extended(strategy: Any, judgment: Any, extend: str, *others: Any) -> tuple[Any, Extension]:
        return judgment, Extension((law,) if extend == "learned" else ())

    monkeypatch.setattr(diagnose, "extended", extended)
    monkeypatch.setattr(diagnose, "with_open_answers", published)
    monkeypatch.setattr(diagnose, "open_amplitudes", lambda *_: {})
    some: Any = SimpleNamespace(problem=None, simulated_problem=None)
    strategy: Any = SimpleNamespace(model=SimpleNamespace(setup=SETUP))
    judgment: Any = SimpleNamespace(answer=SimpleNamespace(effects=(law,)))
    _, extension, result = diagnose._extended(some, strategy, judgment, extend, some)
    assert extension.effects == ((law,) if used else ())
    assert result.determines == (min(without, with_it if used else without) < 5000.0)
