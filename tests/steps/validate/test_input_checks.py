"""Whether a torque belongs to a speed, and the message on a simulation that misses the drive."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.steps.validate.test_validate import changed
from tests.steps.validate.validate_cases import inputs, prepared, true_parameters
from vdyn_cli.project.inputs import Inputs
from vdyn_cli.steps.failure import UnpublishedError
from vdyn_cli.steps.validate.input_checks import torque_correlation


@pytest.fixture(name="found")
def _found(root: Path, tmp_path: Path) -> Inputs:
    return inputs(root, tmp_path, true_parameters(), model="road_load")


def said(found: Inputs) -> str:
    with pytest.raises(UnpublishedError) as caught:
        prepared(found).publish()
    return str(caught.value)


def test_a_torque_of_this_drive_correlates_with_its_acceleration(found: Inputs) -> None:
    assert torque_correlation(prepared(found).segmented[0]) > 0.9


def test_a_wrong_scale_is_not_taken_for_a_torque_of_another_drive(found: Inputs) -> None:
    wrong = said(replace(found, data=changed(found, drive_torque=lambda v: 2.0 * v)))
    assert "although the acceleration follows it (correlation 1.00)" in wrong
    assert "a force or a scale is missing or wrong" in wrong


def test_a_torque_of_another_time_does_not_correlate(found: Inputs) -> None:
    shifted = changed(found, drive_torque=lambda v: np.roll(v, v.size // 2))
    wrong = said(replace(found, data=shifted))
    assert "although" not in wrong
    assert "-> check that torque and speed belong to one drive and one clock" in wrong
