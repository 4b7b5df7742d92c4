"""A surveyed road as the known grade of a coast-down: used, reported, in the intervals, or refused."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.bench.road_profile import described
from tests.plant.messy_day import Case, drawn_day, drive
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.result_document import read_record, to_json
from vdyn_cli.quantities.errors import InputError
from vdyn_cli.quantities.result_schema import ResultDocument
from vdyn_cli.steps import load_step
from vdyn_cli.steps.road_survey import RoadSurvey

SEED = 103


@pytest.fixture(scope="module")
def case() -> Case:
    day = drawn_day("undulating", SEED)
    return drive(SEED, replace(day, runs=4, rms=2e-3, logger=replace(day.logger, rate=5.0)))


def changed(path: Path, **runs_and_settings: object) -> Path:
    text = yaml.safe_load(path.read_text())
    text.update(runs_and_settings)
    path.write_text(yaml.safe_dump(text))
    return path


@pytest.mark.slow
def test_the_survey_is_used_and_reported(case: Case, tmp_path: Path) -> None:
    record = execute("coastdown", described(case, SEED, tmp_path, kind="surveyed"), level=None)
    known = record.result.parameters
    for name in ("rolling_resistance", "drag_area"):
        low, high = known[name].interval95
        assert low <= case.truth[name] <= high
    assert known["rolling_resistance"].std < 0.03 * known["rolling_resistance"].value  # the bench has that without
    road = record.document["quality"]["road"]
    assert road["profile"] == "road.csv"
    assert road["std"] == pytest.approx(0.005)
    assert any("the intervals include its error" in f.what for f in record.result.findings)
    assert "road.csv" in record.provenance.inputs
    ResultDocument.model_validate(record.document)
    (tmp_path / "coastdown.json").write_text(to_json(record.document))
    assert read_record(tmp_path / "coastdown.json")[0].result.quality.road == road


def test_a_survey_of_the_opposite_sign_is_a_doubt(case: Case, tmp_path: Path) -> None:
    path = described(case, SEED, tmp_path, kind="surveyed", sign=-1.0)
    inputs = gather(load_step("coastdown"), path)
    problem = inputs.step.prepare(inputs.spec, inputs.data, inputs.known)
    (doubt,) = [f for f in problem.findings if f.where == "road.csv"]
    assert "decelerations show -" in doubt.what
    assert "opposite sign" in doubt.remedy


def test_the_grade_turns_with_the_way(case: Case, tmp_path: Path) -> None:
    inputs = gather(load_step("coastdown"), described(case, SEED, tmp_path, kind="surveyed"))
    out, back = inputs.logs[0], inputs.logs[1]
    place = 0.5 * (
        max(out["position"].min(), back["position"].min()) + min(out["position"].max(), back["position"].max())
    )
    near = [np.abs(log["position"] - place) < 5.0 for log in (out, back)]
    assert out["grade"][near[0]].mean() == pytest.approx(-back["grade"][near[1]].mean(), abs=2e-3)


def test_a_survey_that_is_too_short_is_refused_with_both_spans(case: Case, tmp_path: Path) -> None:
    path = described(case, SEED, tmp_path, kind="surveyed")
    (tmp_path / "road.csv").write_text("position [m],grade [%]\n0,0.1\n200,0.2\n")
    with pytest.raises(InputError, match=r"road.csv covers 0 m to 200 m") as refused:
        gather(load_step("coastdown"), path)
    assert "survey the rest" in str(refused.value)


def test_a_survey_needs_the_position_and_columns(case: Case, tmp_path: Path) -> None:
    path = described(case, SEED, tmp_path, kind="surveyed")
    text = yaml.safe_load(path.read_text())
    channels = {n: c for n, c in text["channels"].items() if n != "position"}
    changed(path, channels=channels)
    with pytest.raises(InputError, match="has no channel 'position'"):
        gather(load_step("coastdown"), path)
    (tmp_path / "road.csv").write_text("station [m],curvature [1/m]\n0,0.1\n200,0.2\n")
    with pytest.raises(InputError, match="has no column elevation or grade"):
        gather(load_step("coastdown"), path)
    (tmp_path / "road.csv").unlink()
    with pytest.raises(InputError, match=r"road.csv does not exist"):
        gather(load_step("coastdown"), path)


def test_elevations_and_grades_give_the_grade_between_points() -> None:
    position, zeros = np.array([0.0, 100.0, 300.0]), np.zeros(3)
    heights = RoadSurvey("a", position, np.array([0.0, 1.0, 0.0]), zeros, True)
    np.testing.assert_allclose(heights.grade(np.array([50.0, 200.0])), [0.01, -0.005])
    grades = RoadSurvey("b", position, np.array([0.0, 0.01, 0.01]), zeros + 0.001, False)
    np.testing.assert_allclose(grades.grade(np.array([50.0, 200.0])), [0.005, 0.01])
    assert grades.uncertain
    assert not heights.uncertain
