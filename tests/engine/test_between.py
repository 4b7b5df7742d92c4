"""Corners of an input that lie between samples."""

from __future__ import annotations

import numpy as np
import pytest

from tests.engine.plants import ROAD, ROAD_LOAD
from vdyn_cli.engine.lead import LEAD, read_ahead
from vdyn_cli.engine.simulate import Drive, Simulator

KNOTS, FORCE = np.array([0.0, 3.04, 3.46, 9.02, 9.17, 20.0]), np.array([0.0, 0.0, 1500.0, 1500.0, -300.0, -300.0])
TIME = np.arange(0.0, 20.0, 0.1)
CORNERS = (KNOTS[1:-1], FORCE[1:-1])


def drive(time: np.ndarray, **between: tuple[np.ndarray, np.ndarray]) -> Drive:
    inputs = {"drive_force": np.interp(time, KNOTS, FORCE), "wind": 0.0, "grade": 0.01}
    return Drive(time, inputs, {"speed": 10.0}, {}, {"heading": 1.0}, between)


def speed(drive: Drive, substeps: int) -> np.ndarray:
    return Simulator(ROAD_LOAD, ROAD, substeps=substeps)(drive).outputs["speed"]


@pytest.mark.parametrize("substeps", [10, 20])
def test_a_corner_at_a_substep_is_met_as_by_a_finer_log(substeps: int) -> None:
    fine = speed(drive(np.arange(0.0, 19.905, 0.01)), substeps // 10)[::10]
    assert speed(drive(TIME, drive_force=CORNERS), substeps) == pytest.approx(fine, abs=1e-9)
    assert np.abs(speed(drive(TIME), substeps) - fine).max() > 1e-3


def test_corners_are_read_ahead_with_their_input() -> None:
    late = Drive(
        TIME, {"force": np.interp(TIME - 0.25, KNOTS, FORCE)}, between={"force": (CORNERS[0] + 0.25, FORCE[1:-1])}
    )
    ahead = read_ahead(late, {("force", LEAD): 0.25})
    assert ahead.between["force"][0] == pytest.approx(CORNERS[0])
    away = np.min(np.abs(TIME[:, None] - KNOTS[None, :]), axis=1) > 0.35
    assert ahead.inputs["force"][away] == pytest.approx(np.interp(TIME, KNOTS, FORCE)[away], abs=1e-6)


@pytest.mark.parametrize("at", [[-1.0, 3.0], [3.0, 25.0], [4.0, 3.0], [3.0, 4.0, 5.0]])
def test_points_that_are_not_between_the_samples_are_refused(at: list[float]) -> None:
    with pytest.raises(ValueError, match="drive_force"):
        drive(TIME, drive_force=(np.array(at), np.zeros(2)))
