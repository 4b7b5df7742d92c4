"""Requests of a description to the diagnosis; errors in them are reported with file and line."""

from __future__ import annotations

from pathlib import Path

import pytest

from tests.descriptions import described
from vdyn_cli.project.execute import execute
from vdyn_cli.project.inputs import gather, placed
from vdyn_cli.quantities.errors import Finding, InputError
from vdyn_cli.steps import load_step


def line_of(path: Path, words: str) -> str:
    lines = path.read_text().splitlines()
    return f"{path.name}:{next(k for k, line in enumerate(lines, 1) if words in line)}"


def test_all_that_is_wrong_with_the_listed_effects_is_reported_at_once(tmp_path: Path, root: Path) -> None:
    asked = "diagnose:\n  effects:\n    - headwind\n    - headwinds\n    - headwind  # again\n  extend: [road_grade]\n"
    path = described(tmp_path, root, "coastdown", ("", asked))
    with pytest.raises(InputError) as refused:
        execute("coastdown", path)
    unknown, twice, unsought = refused.value.findings
    assert (unknown.where, unknown.remedy) == (line_of(path, "headwinds"), "did you mean headwind?")
    assert (twice.where, twice.what) == (line_of(path, "again"), "'diagnose.effects': is listed twice")
    assert unsought.where == line_of(path, "extend:")
    assert unsought.what == "'diagnose.extend': is not in diagnose.effects, so it is not tested"
    assert unsought.got == "road_grade"


def test_an_effect_that_does_not_apply_to_the_model_is_reported_with_its_line(tmp_path: Path, root: Path) -> None:
    """Only the model shows it: a coasting car has no torque with a gain."""
    path = described(tmp_path, root, "coastdown", ("", "diagnose: {effects: [road_grade, torque_gain]}\n"))
    with pytest.raises(InputError) as refused:
        execute("coastdown", path)
    (finding,) = refused.value.findings
    assert finding.where == line_of(path, "diagnose:")
    assert finding.what == "'diagnose.effects': is not a candidate effect for this model"
    assert finding.got == "torque_gain"


def test_missing_logs_are_reported_beside_wrong_effects(tmp_path: Path, root: Path) -> None:
    """Two days may each have a ``coast_1.csv``: messages name logs as the description does."""
    path = described(tmp_path, root, "coastdown", ("", "diagnose: {effects: [headwinds]}\n"))
    text = path.read_text()
    for k, day in ((1, "monday"), (2, "tuesday")):
        (tmp_path / day).mkdir()
        (tmp_path / day / "coast.csv").write_text("Time [s],Nothing\n0,1\n1,2\n")
        text = text.replace(str(root / "sample_logs" / f"coast_{k}.csv"), f"{day}/coast.csv")
    path.write_text(text.replace(str(root / "sample_logs" / "coast_3.csv"), "gone.csv"))
    with pytest.raises(InputError) as refused:
        execute("coastdown", path)
    told = [str(f) for f in refused.value.findings]
    assert any("headwinds" in one for one in told)
    assert any("gone.csv" in one for one in told)
    assert any("no such column in monday/coast.csv, tuesday/coast.csv" in one for one in told)


def test_a_log_may_be_called_as_a_key_is(tmp_path: Path, root: Path) -> None:
    """``runs.csv`` is a file, not a place in the description."""
    path = described(tmp_path, root, "coastdown")
    text = path.read_text()
    log = root / "sample_logs" / "coast_1.csv"
    (tmp_path / "runs.csv").write_bytes(log.read_bytes())
    path.write_text(text.replace(str(log), "runs.csv"))
    inputs = gather(load_step("coastdown"), path)
    finding = Finding("runs.csv, acceleration", "falls")
    assert placed(finding, inputs.spec, inputs.source, inputs.logs) is finding
    assert placed(Finding("runs", "there are none"), inputs.spec, inputs.source, inputs.logs).where == line_of(
        path, "runs:"
    )
    bump = gather(load_step("bump"), described(tmp_path, root, "bump"))
    finding = Finding("bump", "mass is needed and not given")
    assert placed(finding, bump.spec, bump.source, bump.logs) is finding


def test_what_a_step_refuses_of_its_description_is_reported_with_its_line(tmp_path: Path, root: Path) -> None:
    path = described(tmp_path, root, "validate", ("driven: front", "driven: front\n  step: 0.01"))
    with pytest.raises(InputError) as refused:
        execute("validate", path)
    (finding,) = refused.value.findings
    assert finding.where == line_of(path, "step: 0.01")
    assert finding.what.startswith("'settings.step': is longer than")
