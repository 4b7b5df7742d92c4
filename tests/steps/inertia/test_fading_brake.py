"""Pads that still rub when a log begins, or a cold bearing: their torque is no zero of the sensor and no inertia."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.plant.plain_wheel import INERTIA, write_drives
from vdyn_cli.project.execute import execute


@pytest.mark.thorough
@pytest.mark.slow  # a diagnosis of 4 s
def test_brakes_that_let_go_slowly_are_a_set_with_a_cold_bearing(tmp_path: Path) -> None:
    result = execute("inertia", write_drives(tmp_path, 21, fading=25.0)).result
    (either,) = result.diagnosis.ambiguous
    assert set(either) == {"brake_drag_fading", "bearing_warmup"}
    low, high = result.parameters["wheel_inertia"].interval95
    assert low < INERTIA < high < 1.25 * INERTIA
