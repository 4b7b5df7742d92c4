from __future__ import annotations

from pathlib import Path

import pytest

from vdyn_cli.project.checks.check import check
from vdyn_cli.project.checks.exact_values import exact_values, implausible_rotating_mass
from vdyn_cli.project.inputs import gather
from vdyn_cli.steps import load_step


def test_a_mass_without_its_uncertainty_is_noted_with_a_remedy_that_clears_it(root: Path, tmp_path: Path) -> None:
    text = (root / "configs" / "coastdown.yaml").read_text(encoding="utf-8")
    text = text.replace("../sample_logs", str(root / "sample_logs"))
    for mass, noted in (("1588 kg", True), ("1588 +- 3 kg", False)):
        path = tmp_path / "coast.yaml"
        vehicle = f"vehicle: {{mass: {mass}, rotating_mass: 60 kg, frontal_area: 2.19 m^2}}"
        path.write_text(text.replace("vehicle: vehicle.yaml", vehicle), encoding="utf-8")
        found = exact_values(gather(load_step("coastdown"), path))
        assert bool(found) is noted
        assert all(
            "mass = 1588 kg and rotating_mass = 60 kg, without an error" in f.what and "+- 3 kg" in f.remedy
            for f in found
        )


@pytest.mark.slow
def test_a_rotating_mass_out_of_proportion_is_doubted(root: Path, tmp_path: Path) -> None:
    text = (root / "configs" / "coastdown.yaml").read_text(encoding="utf-8")
    text = text.replace("../sample_logs", str(root / "sample_logs"))
    for rotating, share in (("60 kg", None), ("1588 kg", "100 % of mass")):
        path = tmp_path / "coast.yaml"
        vehicle = f"vehicle: {{mass: 1588 kg, rotating_mass: {rotating}, frontal_area: 2.19 m^2}}"
        path.write_text(text.replace("vehicle: vehicle.yaml", vehicle), encoding="utf-8")
        found = implausible_rotating_mass(gather(load_step("coastdown"), path))
        assert [share in f.what for f in found if share] == ([True] if share else [])
        assert bool(found) is (share is not None)
        document, _ = check(path)
        assert document.sentence.startswith("Doubtful: rotating_mass is 100 % of mass") is (share is not None)
        assert any(f.doubt and "rotating_mass" in f.what for f in document.findings) is (share is not None)
