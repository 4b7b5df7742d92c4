"""Decimation preserves the visible features of lines and points."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.report import decimation


def test_envelope_keeps_every_peak_and_stays_small() -> None:
    x = np.arange(1_000_000.0)
    y = np.sin(x / 1e5)
    y[123_456] = 9.0
    y[777_777] = -9.0
    a, b = decimation.envelope(x, y, 500)
    assert a.size == b.size <= 1000
    assert b.max() == 9.0
    assert b.min() == -9.0
    assert np.all(np.diff(a) >= 0)


def test_short_lines_are_left_alone() -> None:
    x = np.arange(50.0)
    a, b = decimation.envelope(x, -x, 100)
    np.testing.assert_array_equal(a, x)
    np.testing.assert_array_equal(b, -x)


@given(st.integers(0, 5000), st.integers(1, 300))
def test_envelope_takes_any_length(n: int, columns: int) -> None:
    x = np.arange(float(n))
    y = np.cos(x)
    a, b = decimation.envelope(x, y, columns)
    assert a.size == b.size
    assert a.size <= max(4 * columns, 1)
    if n:
        assert np.nanmax(b) == y.max()
        assert np.nanmin(b) == y.min()


def test_a_slow_channel_in_a_fast_log_is_one_line() -> None:
    time = np.arange(0.0, 10, 0.01)
    slow = np.where(np.arange(time.size) % 10 == 0, time, np.nan)
    x, y = decimation.connected(time, slow)
    assert np.isfinite(y).all()
    assert x.size == 100


def test_a_gap_stays_a_gap_also_when_thinned() -> None:
    time = np.concatenate([np.arange(0.0, 10, 0.001), np.arange(15.0, 25, 0.001)])
    x, y = decimation.connected(time, np.ones(time.size))
    assert np.count_nonzero(np.isnan(y)) == 1
    _, thinned = decimation.envelope(x, y, 200)
    assert np.count_nonzero(np.isnan(thinned)) >= 1


def test_a_cloud_keeps_its_outline() -> None:
    rng = np.random.default_rng(1)
    x, y = rng.normal(size=(2, 200_000))
    chosen = decimation.cloud(x, y, (100, 100), 3000)
    assert chosen.size <= 3000
    assert np.ptp(x[chosen]) > 0.7 * np.ptp(x)
    assert decimation.cloud(x[:10], np.full(10, np.nan), (5, 5), 3).size == 0


def test_means_by_bin() -> None:
    edges = np.array([0.0, 1.0, 2.0, 3.0])
    position = np.array([0.5, 0.6, 1.5, 3.0, 5.0, np.nan])
    values = np.array([1.0, 3.0, np.nan, 7.0, 100.0, 100.0])
    np.testing.assert_array_equal(decimation.means(position, values, edges, 1), [2.0, np.nan, 7.0])
