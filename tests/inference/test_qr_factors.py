"""Bases of dependent columns."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.inference.qr_factors import orthonormal
from vdyn_cli.quantities.arrays import Array


def test_the_basis_is_the_same_where_divide_and_conquer_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    columns = np.random.default_rng(1).normal(size=(20, 3)) @ np.array(
        [[1.0, 0.0, 2.0, 1.0], [0, 1, 1, 0], [0, 0, 0, 1]]
    )
    basis = orthonormal(columns)

    def fails(matrix: Array, full_matrices: bool) -> None:
        raise np.linalg.LinAlgError("SVD did not converge")

    monkeypatch.setattr(np.linalg, "svd", fails)
    other = orthonormal(columns)
    assert basis.shape == other.shape == (20, 3)
    np.testing.assert_allclose(other @ other.T, basis @ basis.T, atol=1e-12)
