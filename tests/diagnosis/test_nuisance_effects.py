"""Sensor errors that the baseline contains, beside an answer."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.name import nuisance_effects
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel
from vdyn_cli.diagnosis.name.nuisance_effects import with_nuisance_effects
from vdyn_cli.diagnosis.size.finding_size import FindingSize, Limits, finding_size
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy


@pytest.mark.parametrize(("beside", "named"), [(0.001, "wave"), (2.0, "slope")])
def test_an_answer_that_only_stood_for_a_latency_is_replaced_by_it(
    monkeypatch: pytest.MonkeyPatch, beside: float, named: str
) -> None:
    """``slope`` changes the output by ``beside`` once ``wave``, the sensor error, is in the model."""
    real = open_strategy(Campaign(5, hidden={"slope": 4.0, "wave": 3.0}).setup(cause("slope"), cause("wave")))

    def model(_: Any, effects: tuple[str, ...]) -> CandidateModel:
        fitted = real.fitted(effects)
        assert fitted is not None
        return CandidateModel(effects, fitted, 0.5, None, 0.0)

    def size(_: Any, without: Any, found: Any) -> FindingSize:
        last = without.effects == ("wave",)
        return replace(finding_size(real, without, found), plain=True, change=beside if last else 1.0, every=beside)

    def covering(_: Any, fitted: Any) -> list[CandidateModel]:
        return [model(None, (*fitted.effects, "wave"))]

    for name, what in (("candidate_model", model), ("finding_size", size), ("_covering", covering)):
        monkeypatch.setattr(nuisance_effects, name, what)
    strategy: Any = SimpleNamespace(
        model=real.model, base=real.base, relinearized=lambda f: f, prior_values={"mass": 1}
    )
    judgment = Judgment("named", "", real.base, detect(real, real.base), (), (model(None, ("slope",)),))
    monkeypatch.setattr(nuisance_effects, "held_out_gain", lambda *_: None)
    found = with_nuisance_effects(strategy, judgment, Limits(output=0.1, noise=1.0))
    assert found.answer is not None
    assert found.answer.effects == (("wave",) if named == "wave" else ("slope", "wave"))
