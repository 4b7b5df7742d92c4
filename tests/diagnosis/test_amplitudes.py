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
    judgment = Judgment("named", "", base, detect(strategy, base), (), (answer,))
    amplitudes = fitted_amplitudes(answer, setup)
    found = open_amplitudes(strategy, judgment, amplitudes)
    assert found["slope"].half_width >= amplitudes["slope"].half_width
    assert found["slope"].interval95[0] < 4.0 < found["slope"].interval95[1]
