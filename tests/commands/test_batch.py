"""``vdyn batch``: many campaigns in one table; a failed one does not stop the others."""

from __future__ import annotations

import csv
from pathlib import Path
from typing import Any

import pytest
import yaml

from vdyn_cli.commands.run_batch import COLUMNS, run_batch
from vdyn_cli.project.archive import archived_campaigns
from vdyn_cli.quantities.errors import InputError

SECTION = {"outer_diameter": "25 mm", "length": "0.5 m"}


def _shaft(length: str) -> dict[str, Any]:
    """A half-shaft's drawing: the cheapest test, without a log."""
    return {"test": "shaft", "sections": {"left": [{**SECTION, "length": length}]}}


def _write(path: Path, content: dict[str, Any]) -> Path:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(yaml.safe_dump(content), encoding="utf-8")
    return path


@pytest.fixture
def archive(tmp_path: Path) -> Path:
    """A pipeline of one test, a test alone, a test without its log, and a vehicle's file."""
    root = tmp_path / "archive"
    _write(root / "monday" / "shaft.yaml", _shaft("0.5 m"))
    _write(root / "monday" / "pipeline.yaml", {"pipeline": "Monday", "steps": ["shaft.yaml"]})
    _write(root / "tuesday.yaml", _shaft("0.4 m"))
    _write(root / "vehicle.yaml", {"mass": 1500})
    lost = {"time": {"column": "t", "unit": "s"}, "speed": {"column": "v", "unit": "m/s"}}
    _write(root / "wednesday.yaml", {"test": "coastdown", "channels": lost, "runs": [{"log": "lost.csv"}]})
    return root


def test_one_table_holds_every_campaign_and_what_failed(archive: Path, tmp_path: Path) -> None:
    said: list[str] = []
    table = tmp_path / "table.csv"
    code = run_batch([archive], str(table), tmp_path / "kept", 1, lambda text, detail=False: said.append(text))
    rows = list(csv.DictReader(table.read_text(encoding="utf-8").splitlines()))
    assert code == 1
    assert tuple(rows[0]) == COLUMNS
    stiffness = {r["campaign"]: float(r["value"]) for r in rows if r["parameter"] == "shaft_stiffness_left"}
    assert stiffness["tuesday"] == pytest.approx(1.25 * stiffness["monday/pipeline"], rel=1e-6)
    (failed,) = [r for r in rows if r["campaign"] == "wednesday"]
    assert failed["verdict"] == "failed"
    assert "lost.csv" in failed["problem"]
    assert any("the input is wrong: " in line and "the log lost.csv does not exist" in line for line in said)
    assert said[-1] == "2 of 3 campaigns are complete; not: wednesday"
    assert (tmp_path / "kept" / "tuesday" / "shaft.json").exists()


def test_all_good_is_exit_code_zero_and_the_table_the_same(archive: Path, capsys: pytest.CaptureFixture[str]) -> None:
    good = [archive / "monday", archive / "tuesday.yaml", archive / "tuesday.yaml"]
    texts = []
    for _ in range(2):
        assert run_batch(good, "-", None, 2, lambda text, detail=False: None) == 0
        texts.append(capsys.readouterr().out)
    assert texts[0] == texts[1]
    assert {line.split(",")[0] for line in texts[0].splitlines()[1:]} == {"pipeline", "tuesday"}


def test_an_archive_without_a_description_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="contains no description"):
        archived_campaigns([tmp_path])
    with pytest.raises(InputError, match="does not exist"):
        archived_campaigns([tmp_path / "nowhere"])
    (tmp_path / "run.csv").write_text("t,v\n0,1\n", encoding="utf-8")
    with pytest.raises(InputError, match="neither a folder nor a description"):
        archived_campaigns([tmp_path / "run.csv"])


def test_a_folder_is_no_table_and_says_so_before_anything_runs(archive: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is a folder"):
        run_batch([archive], str(tmp_path), None, 1, lambda text, detail=False: pytest.fail(text))


def test_a_description_that_cannot_be_read_is_a_failed_campaign(tmp_path: Path) -> None:
    (tmp_path / "broken.yaml").write_text("test: [shaft", encoding="utf-8")
    _write(tmp_path / "shaft.yaml", _shaft("0.5 m"))
    broken, good = sorted(archived_campaigns([tmp_path]), key=lambda c: c.name)
    assert broken.problems
    assert [t.name for t in good.tasks] == ["shaft"]
