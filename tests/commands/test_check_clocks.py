"""``vdyn check`` of logs whose clock has gaps or lost samples."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.commands.test_check import RUNS, campaign, checked

pytestmark = pytest.mark.slow  # a check of eight runs each


def test_the_longest_gap_of_a_clock_has_its_times(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    rows = (tmp_path / "coast_1.csv").read_text().splitlines()
    (tmp_path / "coast_1.csv").write_text("\n".join(rows[:200] + rows[210:400] + rows[440:]))
    flags = [f for f in checked(path, tmp_path / "out", 0)["flags"] if f["test"] == "clock_gap"]
    assert [(f["from"], f["to"], f["segments"]) for f in flags] == [(pytest.approx(39.8), pytest.approx(43.9), 2)]


def test_a_coast_with_a_long_gap_of_the_clock_is_to_be_repeated(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    rows = (tmp_path / "coast_1.csv").read_text().splitlines()
    (tmp_path / "coast_1.csv").write_text("\n".join(rows[:300] + rows[700:]))
    document = checked(path, tmp_path / "out", 1)
    assert [r["run"] for r in document["runs"] if r["verdict"] == "repeat"] == ["coast_1.csv"]
    (why,), (gap,) = document["runs"][1]["why"], [f for f in document["flags"] if f["test"] == "clock_gap"]
    assert "are missing: time steps by 40.1 s" in why
    assert gap["share"] == pytest.approx(40.1 / 94.9, rel=1e-3)
    coasts = document["coasts"]
    assert any("do not include the runs to repeat" in s and "coast_1" in s for s in coasts["sentences"])
    assert (coasts["out"], coasts["back"], coasts["pairs"]) == (4, 3, 3)
    assert [row["mean"] is None for row in coasts["runs"]] == [k == 1 for k in range(RUNS)]
    assert coasts["runs"][1]["influence"] is not None


def test_a_clock_that_lost_samples_is_noted(tmp_path: Path) -> None:
    path = campaign(tmp_path, lambda run, time, speed: speed)
    rows = (tmp_path / "coast_1.csv").read_text().splitlines()
    kept = np.random.default_rng(4).random(len(rows)) < 0.6
    kept[0] = True
    (tmp_path / "coast_1.csv").write_text("\n".join(r for r, k in zip(rows, kept, strict=True) if k))
    document = checked(path, tmp_path / "out", 0)
    noted = {run["run"]: " ".join(run["why"]) for run in document["runs"]}
    assert "uneven clock: 90 % of the steps lie between 0.1 s and" in noted.pop("coast_1.csv")
    assert not any("uneven clock" in why for why in noted.values())
