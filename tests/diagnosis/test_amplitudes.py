"""Amplitudes of a named effect, with intervals widened by its residual."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.extend.amplitudes import fitted_amplitudes, open_amplitudes
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy


@pytest.mark.parametrize("linearized", [False, True], ids=["simulated", "linearized once"])
def test_an_amplitude_holds_the_bias_by_a_remainder_however_the_model_is_fitted(linearized: bool) -> None:
    campaign = Campaign(5, hidden={"slope": 4.0, "wave": 3.0})
    setup = replace(campaign.setup(cause("slope")), linearized=linearized)
    strategy = open_strategy(setup)
    fitted, base = strategy.fitted(("slope",)), strategy.fitted(())
    assert fitted is not None
    assert base is not None
    answer = CandidateModel(("slope",), fitted, 0.001, "shape", 0.05)
    judgment = Judgment(base, detect(strategy, base), accepted=(answer,), material=True)
    amplitudes = fitted_amplitudes(answer, setup)
    found = open_amplitudes(strategy, judgment, amplitudes)
    assert found["slope"].half_width >= amplitudes["slope"].half_width
    assert found["slope"].interval95[0] < 4.0 < found["slope"].interval95[1]


def test_an_amplitude_is_mixed_with_relinearized_answers(monkeypatch: pytest.MonkeyPatch) -> None:
    """A linear fit may give a large amplitude several times too large beside a further effect."""
    campaign = Campaign(5, hidden={"slope": 4.0})
    strategy = open_strategy(campaign.setup(cause("slope"), cause("wave")))
    fitted, both, base = (strategy.fitted(effects) for effects in (("slope",), ("slope", "wave"), ()))
    assert fitted is not None
    assert both is not None
    assert base is not None
    solution = replace(
        both.solution,
        values={**both.solution.values, "slope": 40.0},
        interval95={**both.solution.interval95, "slope": (39.0, 41.0)},
    )
    linear = CandidateModel(("slope", "wave"), replace(both, solution=solution), 0.5, None, 0.0)
    monkeypatch.setattr("vdyn_cli.diagnosis.extend.amplitudes.probable_answers", lambda *_: [(linear, 0.3)])
    monkeypatch.setattr(type(strategy), "relinearized", lambda *_: both)
    answer = CandidateModel(("slope",), fitted, 0.5, None, 0.0)
    judgment = Judgment(base, detect(strategy, base), accepted=(answer,), material=True)
    found = open_amplitudes(strategy, judgment, fitted_amplitudes(answer, strategy.model.setup))
    assert found["slope"].interval95[1] < 10.0
