"""Logs averaged to the rate that a step needs."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.io.clocks.block_means import condensed, condensing_note
from vdyn_cli.quantities.log import Log


def ramp(rate: float, seconds: float, **more: np.ndarray) -> Log:
    time = 100.0 + np.arange(int(rate * seconds)) / rate
    return Log("ramp.csv", time, {"speed": 30.0 - 0.3 * (time - 100.0), **more})


def test_a_straight_line_stays_exact() -> None:
    after = condensed(ramp(1000.0, 10.0), 20.0)
    assert after.time.size == 200
    assert after["speed"] == pytest.approx(30.0 - 0.3 * (after.time - 100.0), abs=1e-12)


def test_noise_is_that_of_the_mean() -> None:
    noise = np.random.default_rng(1).standard_normal(100_000)
    after = condensed(ramp(1000.0, 100.0, noise=noise), 20.0)
    assert np.std(after["noise"]) == pytest.approx(1.0 / np.sqrt(50.0), rel=0.05)


def test_a_log_sampled_less_than_twice_as_fast_stays_as_it_is() -> None:
    log = ramp(39.0, 10.0)
    assert condensed(log, 20.0) is log
    assert condensing_note((log,), (log,), 20.0) == ()


def test_a_gap_has_no_rows_and_missing_samples_no_mean() -> None:
    log = ramp(1000.0, 10.0, load=np.where(np.arange(10_000) < 80, np.nan, 5.0))
    keep = (log.time < 103.0) | (log.time > 105.0)
    cut = Log(log.name, log.time[keep], {n: v[keep] for n, v in log.channels.items()})
    after = condensed(cut, 20.0)
    assert not np.any((after.time > 103.0) & (after.time < 105.0))
    assert np.isnan(after["load"][:2]).tolist() == [True, True]
    assert after["load"][2:] == pytest.approx(5.0)


def test_a_note_says_what_was_averaged() -> None:
    before = (ramp(1000.0, 10.0),)
    (note,) = condensing_note(before, tuple(condensed(log, 20.0) for log in before), 20.0)
    assert note.minor
    assert "10000 rows become 200" in note.what
