"""Rows of half-shaft oscillations: only after a tip-in, white, and independent of the averaged rows."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.log import Log
from vdyn_cli.steps.validate.drives.segments import DriveSegment, RunConditions, Segmentation, drive_segments
from vdyn_cli.steps.validate.fit.residual_rows import RowLayout, row_layout
from vdyn_cli.steps.validate.fit.shaft_oscillation import AFTER, RAMP, shaft_oscillation

TIP_IN = 10.0  # s
CALM = 0.25
LEVEL = 1.0


def tipped_in(step: float) -> tuple[DriveSegment, RowLayout]:
    rng = np.random.default_rng(7)
    time = np.arange(0.0, 30.0, 0.01)
    torque = 100.0 + step * (time > TIP_IN)
    channels = {
        "speed": 10.0 + 0.02 * rng.standard_normal(time.size),
        "drive_torque": torque + LEVEL * rng.standard_normal(time.size),
        "shaft_torque_left": 1.6 * torque + 1.5 * rng.standard_normal(time.size),
        "shaft_torque_right": 1.6 * torque + 1.5 * rng.standard_normal(time.size),
    }
    (made,), _ = drive_segments([Log("a.csv", time, channels)], [RunConditions()], Segmentation("vehicle"))
    true = {"speed": np.full(time.size, 10.0)}
    return made, row_layout(made, ("speed", "shaft_torque_left", "shaft_torque_right"), 0.3, true, CALM)


def still(s: DriveSegment) -> dict[str, np.ndarray]:
    return {n: np.zeros(s.time.size) for n in s.outputs}


def test_only_what_follows_a_tip_in_is_looked_at() -> None:
    s, p = tipped_in(150.0)
    found = shaft_oscillation(s, p, {"drive_torque": 100.0 + 150.0 * (s.time > TIP_IN)}, still(s), LEVEL)
    assert found is not None
    at, rows = found.white(p, {n: v[:, None] for n, v in s.outputs.items()})
    assert at.min() == pytest.approx(TIP_IN - RAMP / 2, abs=0.03)
    assert at.max() == pytest.approx(TIP_IN + RAMP / 2 + AFTER, abs=0.03)
    assert rows.shape == (at.size, 2, 1)


@pytest.mark.parametrize("step", [0.0, 20.0])
def test_a_small_change_is_no_event(step: float) -> None:
    s, p = tipped_in(step)
    assert shaft_oscillation(s, p, {"drive_torque": 100.0 + step * (s.time > TIP_IN)}, still(s), LEVEL) is None


def test_noise_is_white_and_what_lasts_longer_is_not_seen() -> None:
    s, p = tipped_in(150.0)
    found = shaft_oscillation(s, p, {"drive_torque": 100.0 + 150.0 * (s.time > TIP_IN)}, still(s), LEVEL)
    assert found is not None
    noise = {n: p.levels[n] * np.random.default_rng(3).standard_normal((s.time.size, 1)) for n in p.others}
    _, rows = found.white(p, noise)
    assert np.mean(rows**2) == pytest.approx(1.0, abs=0.15)
    _, constant = found.white(p, {n: np.full((s.time.size, 1), 40.0) for n in p.others})
    assert np.abs(constant).max() < 1e-9


def test_without_half_shafts_there_is_nothing_to_see() -> None:
    s, _ = tipped_in(150.0)
    alone = row_layout(s, ("speed",), 0.3, {"speed": np.full(s.time.size, 10.0)}, CALM)
    assert shaft_oscillation(s, alone, {"drive_torque": s.inputs["drive_torque"]}, still(s), LEVEL) is None
