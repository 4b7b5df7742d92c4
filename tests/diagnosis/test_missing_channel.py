"""A candidate that lacks its channel is listed as not testable, with the channel that would make it so."""

from __future__ import annotations

import math
from pathlib import Path

import pytest
import yaml

from tests.conftest import ROOT
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.errors import InputError


def described(folder: Path, without: str = "position", **diagnose: object) -> Path:
    """The sample's coast-downs without their position, or without another key of the channels or runs."""
    text = yaml.safe_load((ROOT / "configs" / "coastdown.yaml").read_text(encoding="utf-8"))
    text["channels"].pop(without, None)
    text["vehicle"] = str(ROOT / "configs" / text["vehicle"])
    text["runs"] = [{**run, "log": str(ROOT / "configs" / run["log"])} for run in text["runs"]]
    text["runs"] = [{key: value for key, value in run.items() if key != without} for run in text["runs"]]
    path = folder / "coastdown.yaml"
    path.write_text(yaml.safe_dump({**text, "diagnose": diagnose}), encoding="utf-8")
    return path


@pytest.mark.slow  # a diagnosis of 3 s
def test_hills_without_a_position_are_listed_with_the_channel_that_they_need(tmp_path: Path) -> None:
    found = execute("coastdown", described(tmp_path)).document["diagnosis"]
    (hills,) = [e for e in found["not_testable"] if e["effect"] == "grade_profile"]
    assert hills["because"] == "needs channel 'position', which is not logged"
    assert math.isnan(hills["size"])
    assert hills["would_bias"] == {}


@pytest.mark.slow
def test_who_requests_them_learns_which_channel_to_map(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="it needs channel 'position', which is not logged"):
        execute("coastdown", described(tmp_path, extend=["grade_profile"]))
    with pytest.raises(InputError, match="it needs the direction of every run, to which 'position' is related"):
        execute("coastdown", described(tmp_path, "direction", extend=["grade_profile"]))
