"""Linearized regressions: the same fit for linear models, and nuisance parameters without bounds."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference import Regression, Rows, Unknown, solve
from vdyn_cli.inference.linearized_regression import blocks_of, linearized

TIME = np.linspace(0.0, 1.0, 120)


def line(level: float, rise: float, known: tuple[float, float] | None) -> Regression:
    measured = level + rise * TIME + np.random.default_rng(7).normal(0.0, 1.0, TIME.size)
    jacobian = np.column_stack([np.ones(TIME.size), TIME])
    unknowns = (
        Unknown("level", known[0] if known else 0.0, 0.02, 50.0, "m", known, nuisance=known is not None),
        Unknown("rise", 0.0, -50.0, 50.0, "m"),
    )
    return Regression(unknowns, ("run",), lambda run, theta: Rows(jacobian @ theta - measured, jacobian, time=TIME))


def test_frozen_is_the_same_fit():
    plain, straight = solve(line(3.0, 2.0, None)), solve(linearized(line(3.0, 2.0, None)))
    assert straight.values["level"] == pytest.approx(plain.values["level"], abs=1e-9)
    assert straight.cost == pytest.approx(plain.cost)


def test_frozen_knows_as_much_of_the_noise():
    """QR factors count as many rows as they were computed from."""
    plain, straight = solve(line(3.0, 2.0, None)), solve(linearized(line(3.0, 2.0, None)))
    assert straight.classical_covariance == pytest.approx(plain.classical_covariance, rel=1e-6)


def test_what_is_known_may_be_found_beyond_what_is_physical():
    """The distance of a known quantity from its prior shows an error; it is not refused for being at its bound."""
    found = solve(linearized(line(-4.0, 2.0, (1.0, 0.3))))
    assert found.values["level"] < -1.0


def test_blocks_do_not_depend_on_the_rounding_of_unknowns_with_the_same_sensitivity() -> None:
    rng = np.random.default_rng(4)
    columns = np.cumsum(rng.normal(size=(200, 3)), axis=0) * np.linspace(0.1, 3.0, 200)[:, None]
    rows = Rows(np.zeros(200), columns, time=np.arange(200.0))

    def blocks(rounding: float) -> list[list[int]]:
        again = columns[:, :2] * (1.0 + rounding * rng.normal(size=(200, 2)))
        matrix = np.column_stack([columns, again, np.zeros(200)])
        return [block.tolist() for block in blocks_of(rows, matrix, 12)]

    assert blocks(1e-14) == blocks(1e-12) == blocks(0.0)
