"""Averages of neighboring samples."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.inference.bins import cut, nodes


@given(st.integers(2, 300), st.floats(0.05, 5.0), st.integers(0, 2**31))
def test_every_sample_is_in_one_bin_and_no_bin_is_too_wide(n: int, width: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.01, 0.5, n))
    bins = cut(time, width)
    assert bins.count.sum() == n
    assert bins.first[0] == 0
    assert np.all(bins.count > 0)
    ends = bins.first + bins.count - 1
    assert np.all(time[ends] - time[bins.first] <= width + 1e-9)
    assert bins.width.sum() == pytest.approx(time[-1] - time[0])


def test_means_of_values_and_of_columns() -> None:
    time = np.arange(0.0, 10.0, 0.5)
    bins = cut(time, 2.0)
    columns = np.column_stack([time, time**2])
    assert np.allclose(bins.mean(time), bins.time)
    assert np.allclose(bins.mean(columns)[:, 0], bins.time)
    assert bins.mean(columns)[0, 1] == pytest.approx(np.mean(time[: bins.count[0]] ** 2))


def test_windows_are_never_joined() -> None:
    time = np.r_[np.arange(0.0, 5.0, 0.1), np.arange(60.0, 65.0, 0.1)]
    part = np.r_[np.zeros(50, dtype=np.int64), np.ones(50, dtype=np.int64)]
    bins = cut(time, 2.0, part)
    assert np.all((bins.time < 5.0) | (bins.time > 60.0))
    assert bins.width.sum() == pytest.approx(9.8)


@given(st.integers(3, 300), st.floats(0.2, 5.0), st.integers(0, 2**31))
def test_nodes_know_the_mean_of_a_parabola_over_uneven_samples(n: int, width: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    time = np.cumsum(rng.uniform(0.01, 0.5, n))
    bins = cut(time, width)
    grid = nodes(time, bins)
    assert np.all(np.diff(grid.time) > 0)
    parabola = np.polynomial.Polynomial(rng.standard_normal(3))
    assert np.allclose(grid.mean(parabola(grid.time)), bins.mean(parabola(time)), rtol=1e-9, atol=1e-8)
    both = np.column_stack([grid.time, grid.time**2])
    assert np.allclose(grid.mean(both)[:, 0], bins.time)
