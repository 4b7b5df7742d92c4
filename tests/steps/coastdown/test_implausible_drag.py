"""A drag coefficient that no road vehicle has is a warning: a mass in pounds, or a speed in miles per hour."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.descriptions import described
from vdyn_cli.project.execute import execute


@pytest.mark.slow
@pytest.mark.parametrize(("mass", "doubted"), [("1588 lb", True), ("1588 kg", False)])
def test_a_mass_in_the_wrong_unit_shows_in_the_drag_coefficient(
    root: Path, tmp_path: Path, mass: str, doubted: bool
) -> None:
    vehicle = f"vehicle: {{mass: {mass}, rotating_mass: 60 kg, frontal_area: 2.19 m^2}}"
    path = described(tmp_path, root, "coastdown", (f"vehicle: {root / 'configs' / 'vehicle.yaml'}", vehicle))
    found = [f for f in execute("coastdown", path, level=None).result.findings if f.where == "drag_coefficient"]
    assert [f.doubt for f in found] == [True] * doubted
    assert all("lower than the drag coefficient of any road vehicle" in f.what for f in found)
