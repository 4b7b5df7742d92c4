"""Play that is fitted on straight lines comes to rest where all knocks fit, not where the first lines lead."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.steps.validate.test_flanks import PLAY, one_drive, simulated
from vdyn_cli.steps.validate import extended, flanks
from vdyn_cli.steps.validate.extended import sized
from vdyn_cli.steps.validate.flanks import rested
from vdyn_cli.steps.validate.regression import weigh

pytestmark = pytest.mark.slow  # whole diagnoses or recoveries


def test_a_size_that_is_begun_too_small_begins_again_where_all_knocks_fit(
    tmp_path_factory: pytest.TempPathFactory, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The lines through two thirds of the size come to rest at little more."""
    monkeypatch.setattr(extended, "PASSES", 2)  # fewer passes and sizes than in earnest: they take time
    monkeypatch.setattr(flanks, "AROUND", (0.8, 0.9, 1.0, 1.1, 1.2))
    drive = one_drive(tmp_path_factory.mktemp("play"))
    found = sized(simulated(drive, PLAY / 1.5), lambda begun: weigh(rested(begun), calm=True).regression)
    size, spread = found.solution.values["backlash"], found.spreads["backlash"]
    assert size == pytest.approx(PLAY, rel=0.1)
    assert size == pytest.approx(PLAY, abs=2 * spread)
    assert found.solution.std["backlash"] < spread < 0.1 * PLAY
    assert found.trial.extra[0].start == size
    assert not found.trial.at
    assert not found.doubts
    (doubt,) = replace(found, moved=2.0).doubts
    assert "have not come to rest: the last pass moved them by 2.0 standard errors" in doubt.what
    assert doubt.doubt
