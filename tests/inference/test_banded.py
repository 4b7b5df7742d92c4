"""Noise with a banded covariance: solving with its factor whitens, solving twice applies the inverse."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference.banded import factored, weighed, whitened


@pytest.mark.parametrize("shape", [(6,), (6, 3)])
def test_solving_twice_is_the_inverse_of_the_covariance(shape: tuple[int, ...]) -> None:
    random = np.random.default_rng(1)
    dense = np.diag(random.uniform(3.0, 4.0, 6))
    for k in (1, 2):
        below = random.uniform(-1.0, 1.0, 6 - k)
        dense += np.diag(below, -k) + np.diag(below, k)
    band = np.array([np.pad(np.diag(dense, -k), (0, k)) for k in range(3)])
    values = random.standard_normal(shape)
    white = whitened(factored(band), values)
    assert white == pytest.approx(np.linalg.solve(np.linalg.cholesky(dense), values))
    assert weighed(factored(band), white) == pytest.approx(np.linalg.solve(dense, values))


def test_a_covariance_of_nothing_is_refused() -> None:
    for band in ([[1.0, 1.0], [2.0, 0.0]], [[np.nan, 1.0], [0.0, 0.0]]):
        with pytest.raises(ArithmeticError):
            factored(np.array(band))


def test_as_many_values_as_the_noise_has() -> None:
    with pytest.raises(ValueError, match="3 values for a factor of 2"):
        whitened(factored(np.array([[1.0, 1.0], [0.0, 0.0]])), np.zeros(3))
