"""Samples of a half-shaft's torque at an impact, which are left out."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.validate.drives.impacts import impact_samples

LEVEL = 1.5  # N m
TIME = np.arange(0.0, 2.0, 0.01)
NOISE = LEVEL * np.random.default_rng(3).standard_normal(TIME.size)
RISE = np.where(TIME < 0.995, 0.0, 180.0 - 80.0 * np.exp(-(TIME - 1.0) / 0.01))  # from 0 to 100 N m within a sample


@pytest.mark.parametrize("way", [1.0, -1.0])
def test_the_last_sample_in_the_gap_and_the_first_beyond_it(way: float) -> None:
    assert np.flatnonzero(impact_samples(way * RISE + NOISE, LEVEL)).tolist() == [99, 100]


@pytest.mark.parametrize("frequency", [3.0, 12.0, 20.0])
def test_an_oscillation_holds_none(frequency: float) -> None:
    assert not impact_samples(300.0 * np.sin(2 * np.pi * frequency * TIME) + NOISE, LEVEL).any()


def test_a_tip_in_without_play_holds_none() -> None:
    """Three newton meters after 10 ms, thirty after 25: half-shafts that oscillate at 12 Hz follow a ramp of 0.15 s."""
    swing = 75.0 * np.maximum(TIME - 1.0, 0.0)
    assert not impact_samples(3000.0 / 75.0 * (swing - np.sin(swing)) + NOISE, LEVEL).any()


def test_missing_samples_hold_none() -> None:
    torque = RISE + NOISE
    torque[98:101] = np.nan
    assert not impact_samples(torque, LEVEL).any()
