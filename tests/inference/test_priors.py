"""Intervals include the uncertainty of priors, which the scatter within the data does not contain."""

from __future__ import annotations

from typing import Literal

import numpy as np
import pytest

from vdyn_cli.inference import Regression, Rows, Unknown, solve


@pytest.mark.slow
def test_zeros_known_only_by_their_prior_widen_the_interval() -> None:
    """y = level + zero of the run + noise: the level cannot be better than the zeros' spread over root of runs."""
    rng = np.random.default_rng(1)
    noise, spread, n = 0.1, 1.0, 200
    errors, inside = [], 0
    for _ in range(200):
        data = [5.0 + spread * rng.standard_normal() + noise * rng.standard_normal(n) for _ in range(4)]

        def rows(run: int, theta: np.ndarray, data: list[np.ndarray] = data) -> Rows:
            residual = (theta[0] + theta[1] - data[run]) / noise
            return Rows(residual, np.full((n, 2), 1 / noise))

        zero = Unknown("zero", 0.0, prior=(0.0, spread), per_run=True, nuisance=True)
        solution = solve(Regression((Unknown("level", 4.0), zero), tuple("abcd"), rows))
        low, high = solution.interval95["level"]
        inside += low < 5.0 < high
        errors.append(solution.values["level"] - 5.0)
        assert solution.std["level"] == pytest.approx(spread / 2, rel=0.05)
    assert np.std(errors) == pytest.approx(spread / 2, rel=0.15)
    assert 180 <= inside <= 198


def test_a_shared_prior_that_the_data_cannot_check_stays_in_the_interval() -> None:
    """y = slope gain x with the gain known to 1 %: so is the slope."""
    rng = np.random.default_rng(2)
    x = np.linspace(1.0, 2.0, 400)
    data = 3.0 * x + 0.01 * rng.standard_normal(x.size)

    def rows(run: int, theta: np.ndarray) -> Rows:
        slope, gain = theta
        return Rows((slope * gain * x - data) / 0.01, np.column_stack([gain * x, slope * x]) / 0.01)

    unknowns = (Unknown("slope", 2.0), Unknown("gain", 1.0, prior=(1.0, 0.01), nuisance=True))
    solution = solve(Regression(unknowns, ("a",), rows))
    assert solution.std["slope"] == pytest.approx(0.03, rel=0.05)


@pytest.mark.parametrize("units", ["run", "block"])
def test_what_only_a_prior_tells_has_the_priors_interval(units: Literal["run", "block"]) -> None:
    rng = np.random.default_rng(4)
    data = [rng.standard_normal(60) for _ in range(8)]
    jacobian = np.column_stack([np.ones(60), np.zeros(60)])
    unknowns = (Unknown("level", 0.0), Unknown("stated", 0.0, prior=(3.0, 2.0)))
    regression = Regression(unknowns, tuple("abcdefgh"), lambda run, x: Rows(jacobian @ x - data[run], jacobian))
    assert solve(regression, units=units).interval95["stated"] == pytest.approx((3 - 3.92, 3 + 3.92), abs=0.01)


@pytest.mark.parametrize("stated", [True, False])
def test_only_a_contradicted_prior_that_is_given_is_told(stated: bool) -> None:
    data = np.random.default_rng(5).standard_normal(60)
    zero = Unknown("zero", 0.0, prior=(3.0, 0.1), nuisance=True, prior_stated=stated)
    regression = Regression((zero,), ("a",), lambda _, x: Rows(x[0] - data, np.ones((60, 1))))
    assert any("from 3, the given or usual value" in w for w in solve(regression).warnings) == stated


def test_priors_that_belong_together_are_weighed_together() -> None:
    """With two correlated priors the fit is the textbook's: information J'J + C^-1."""
    rng = np.random.default_rng(3)
    jacobian, residual = rng.standard_normal((30, 2)), rng.standard_normal(30)
    std, correlation = np.array([0.5, 2.0]), 0.8
    covariance = np.outer(std, std) * np.array([[1.0, correlation], [correlation, 1.0]])
    unknowns = (
        Unknown("a", 0.0, prior=(1.0, 0.5), prior_correlation={"b": correlation}),
        Unknown("b", 0.0, prior=(-1.0, 2.0), prior_correlation={"a": correlation}),
    )
    found = solve(Regression(unknowns, ("run",), lambda _, x: Rows(residual + jacobian @ x, jacobian)))
    known = np.linalg.inv(covariance)
    expected = np.linalg.solve(jacobian.T @ jacobian + known, known @ [1.0, -1.0] - jacobian.T @ residual)
    assert [found.values["a"], found.values["b"]] == pytest.approx(expected)
