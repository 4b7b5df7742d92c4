"""If the baseline has no result and several effects would give one, the result is published with one of them.

A torque that reads 5 % low, or a radius stated 3 % too large, gives a negative inertia of the wheel. For the second, a
linearized model is explained by another wheel mass, which the exact model excludes.
"""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.plant.plain_wheel import INERTIA, write_drives
from vdyn_cli.project.execute import RefusedResultError, execute


@pytest.mark.slow  # two diagnoses of 3 s
@pytest.mark.parametrize(
    "fault",
    [{"torque_factor": 0.95}, pytest.param({"stated_radius": 1.03}, marks=pytest.mark.thorough)],
    ids=["gain", "radius"],
)
def test_a_negative_inertia_is_published_with_what_mends_it(fault: dict[str, float], tmp_path: Path) -> None:
    path = write_drives(tmp_path, 5, **fault)
    with pytest.raises(RefusedResultError, match="negative inertia"):
        execute("inertia", path, level=None)
    result = execute("inertia", path).result
    diagnosis, found = result.diagnosis, result.parameters["wheel_inertia"]
    assert diagnosis.verdict == "ambiguous"
    (named,) = diagnosis.ambiguous
    assert {"hub_torque_gain", "wheel_radius"} <= set(named)
    assert diagnosis.extended
    assert not diagnosis.causes
    assert found.interval95[0] < INERTIA < found.interval95[1]
    assert found.interval95[1] < 1.6 * INERTIA
    true = -5.0 if "torque_factor" in fault else -2.9
    amplitudes = re.findall(r"(-[\d.]+) \+- ([\d.]+) %", diagnosis.sentence)
    assert len(amplitudes) >= 2
    for value, half in amplitudes:  # three standard errors
        assert abs(float(value) - true) < 1.5 * float(half)
    assert not result.parameters.extensions  # one of several possible effects is not stored with the vehicle


@pytest.mark.slow  # a diagnosis of 3 s
def test_a_baseline_that_the_data_exclude_is_neither_value_nor_interval(tmp_path: Path) -> None:
    """A torque that reads 4 % high triples the inertia, and no check refuses such a value."""
    path = write_drives(tmp_path, 21, torque_factor=1.04)
    assert execute("inertia", path, level=None).result.parameters["wheel_inertia"].value > 2 * INERTIA
    result = execute("inertia", path).result
    found = result.parameters["wheel_inertia"]
    assert {"hub_torque_gain", "wheel_radius"} <= set(result.diagnosis.ambiguous[0])
    assert found.interval95[0] < INERTIA < found.interval95[1] < 1.6 * INERTIA
    assert found.baseline > 2 * INERTIA
    assert not result.parameters.extensions
