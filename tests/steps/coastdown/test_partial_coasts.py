"""A run that was broken off is noted by the step, too."""

from __future__ import annotations

from pathlib import Path

import pytest

from vdyn_cli.project.execute import execute

CONFIGS = Path(__file__).parents[3] / "configs"


@pytest.mark.slow
def test_a_broken_off_run_is_noted_with_the_speeds_that_it_covers(tmp_path: Path) -> None:
    text = (CONFIGS / "coastdown.yaml").read_text().replace("coast_1.csv,", "coast_1.csv, to_time: 25 s,")
    text = text.replace("../sample_logs", str(CONFIGS.parent / "sample_logs"))
    text = text.replace("vehicle: vehicle.yaml", f"vehicle: {CONFIGS / 'vehicle.yaml'}")
    (tmp_path / "coast.yaml").write_text(text.replace("speed_window: [74 km/h, 21 km/h]", "windows: auto"))
    findings = execute("coastdown", tmp_path / "coast.yaml", (), None).result.findings
    assert [Path(f.where).name for f in findings if "of the speeds of the other runs" in f.what] == ["coast_1.csv"]
