"""Uncertainty budgets against closed forms and Monte Carlo."""

from __future__ import annotations

import math

import numpy as np
import pytest

from vdyn_cli.inference.uncertainty_budget import Budget, Contribution, propagate
from vdyn_cli.quantities.quantity import Given


def test_a_product_adds_relative_variances() -> None:
    inputs = {"a": Given(2.0, 0.02), "b": Given(5.0, 0.1), "c": Given(7.0)}
    budget = propagate(lambda a, b, c: a * b / c, inputs, {"a": "m"})
    assert budget.value == pytest.approx(10 / 7)
    assert budget.std / budget.value == pytest.approx(math.hypot(0.01, 0.02), rel=1e-6)
    assert [round(c.part, 9) for c in budget.contributions if c.name == "c"] == [0.0]
    assert budget.main is not None
    assert budget.main.name == "b"


def test_an_input_of_zero_still_has_its_slope() -> None:
    assert propagate(lambda x: 3 * x, {"x": Given(0.0, 0.5)}, {}).std == pytest.approx(1.5)


def test_effective_degrees_follow_welch_and_satterthwaite() -> None:
    few = Budget(1.0, (Contribution("data", 1.0, 0.3, "", 1.0, 4.0), Contribution("tape", 1.0, 0.4, "", 1.0)))
    assert few.std == pytest.approx(0.5)
    assert few.degrees == pytest.approx(0.5**4 / (0.3**4 / 4))
    alone = Budget(1.0, (Contribution("data", 1.0, 1.0, "", 1.0, 4.0),))
    assert alone.interval95[1] - 1.0 == pytest.approx(2.7764451, rel=1e-6)


def test_nothing_uncertain_gives_a_point() -> None:
    exact = propagate(lambda x: x**2, {"x": Given(3.0)}, {})
    assert exact.interval95 == (9.0, 9.0)
    assert exact.main is None
    assert exact.table("k", "t", "m").rows[0][2] == "exact"


def test_propagation_agrees_with_monte_carlo() -> None:
    rng = np.random.default_rng(3)
    inputs = {"m": Given(20.0, 0.05), "d": Given(0.2, 0.001), "t": Given(1.4, 0.002)}

    def inertia(m: float, d: float, t: float) -> float:
        return m * d * (9.81 * (t / (2 * math.pi)) ** 2 - d)

    drawn = {n: g.value + g.std * rng.standard_normal(200_000) for n, g in inputs.items()}
    spread = float(np.std(inertia(**drawn)))  # type: ignore[arg-type]
    assert propagate(inertia, inputs, {}).std == pytest.approx(spread, rel=0.01)
