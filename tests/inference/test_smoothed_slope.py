"""Smoothed slopes compared with the true ones."""

from __future__ import annotations

import numpy as np

from vdyn_cli.inference.smoothed_slope import smoothed_slope

STEP, LENGTH, SIZE, NOISE = 20.0, 300.0, 0.01, 0.006


def road(seed: int, count: int = 1500) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    random = np.random.default_rng(seed)
    slope = np.zeros(count)
    kept = np.exp(-STEP / LENGTH)
    for k in range(1, count):
        slope[k] = kept * slope[k - 1] + SIZE * np.sqrt(1 - kept**2) * random.standard_normal()
    return STEP * np.arange(count), slope, slope + NOISE * random.standard_normal(count)


def test_it_is_much_closer_to_the_road_than_it_seems() -> None:
    along, slope, looks = road(1)
    smooth, _ = smoothed_slope(along, looks, np.ones(slope.size, dtype=bool))
    assert np.std(smooth - slope) < 0.65 * NOISE


def test_what_depends_on_the_slope_is_found_in_full_from_the_smoothed_one() -> None:
    found, raw = [], []
    for seed in range(6):
        along, slope, looks = road(seed)
        answer = 2.0 * slope + 0.01 * np.random.default_rng(100 + seed).standard_normal(slope.size)
        smooth, _ = smoothed_slope(along, looks, np.ones(slope.size, dtype=bool))
        found.append(answer @ smooth / (smooth @ smooth))
        raw.append(answer @ looks / (looks @ looks))
    assert np.mean(found) / 2.0 == np.clip(np.mean(found) / 2.0, 0.97, 1.03)
    assert np.mean(raw) / 2.0 < 0.8, "noisy looks flatten it: that is why they are smoothed"


def test_its_standard_deviation_is_what_it_is_off_by() -> None:
    along, slope, looks = road(2)
    seen = np.ones(slope.size, dtype=bool)
    seen[400:440] = False
    smooth, std = smoothed_slope(along, looks, seen)
    assert 0.9 < np.sqrt(np.mean(((smooth - slope) / std) ** 2)) < 1.1
    assert std[420] > 1.5 * std[200], "where nobody looked it is less sure"


def test_a_level_road_stays_level() -> None:
    along = STEP * np.arange(400)
    looks = NOISE * np.random.default_rng(3).standard_normal(400)
    smooth, _ = smoothed_slope(along, looks, np.ones(400, dtype=bool))
    assert not np.any(smooth)
