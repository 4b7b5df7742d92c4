"""Forward selection starts with the strongest effect that can be fitted alone, and drops what only imitates others."""

from __future__ import annotations

from collections.abc import Sequence
from math import inf
from types import SimpleNamespace
from typing import Any

import pytest

from tests.diagnosis.linear import STEP, WAVE, WIND, Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.name import candidate_models
from vdyn_cli.diagnosis.name.candidate_models import forward_selection
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy

EVIDENCE = {"speed": 50.0, "shaft": 90.0, "noise": 0.5}


@pytest.mark.parametrize("refuted", [(), ("shaft",), ("shaft", "speed")])
def test_an_effect_that_fails_alone_is_not_the_first(refuted: tuple[str, ...], monkeypatch: pytest.MonkeyPatch) -> None:
    def model(strategy: Any, effects: Sequence[str], below: float = inf) -> Any:
        alone = len(effects) == 1
        fitted = SimpleNamespace(effects=tuple(effects), sufficient=not alone, fitted=strategy)
        return None if alone and effects[0] in refuted else fitted

    stages: dict[str, Any] = {
        "candidate_model": model,
        "with_next": lambda strategy, tried: model(strategy, (*tried.effects, "next")),
        "catalog_falls_short": lambda strategy, tried: False,
        "all_needed": lambda strategy, tried: True,
        "_is_needed": lambda strategy, tried, effect: True,
        "alternatives": lambda strategy, tried, found: (),
    }
    for name, stage in stages.items():
        monkeypatch.setattr(candidate_models, name, stage)
    found: Any = SimpleNamespace(scores=SimpleNamespace(evidence=EVIDENCE), testable=tuple(EVIDENCE))
    there: Any = SimpleNamespace()  # linearized about the fit of two effects
    strategy: Any = SimpleNamespace(about=lambda fitted: there)
    chain = forward_selection(strategy, (), found)
    first = next((n for n in ("shaft", "speed") if n not in refuted), None)
    assert [(one.effects, one.fitted) for one in chain] == ([((first, "next"), there)] if first else [])


def test_an_effect_that_imitates_two_others_is_dropped_beside_them() -> None:
    """The mixture of wave and step has the strongest evidence, and is not significant beside both."""
    campaign = Campaign(0, hidden={"wave": 4.0, "step": 4.0})
    strategy = open_strategy(campaign.setup(WAVE, STEP, WIND, cause("mixture")))
    found = detect(strategy, strategy.base)
    assert found.scores.strongest(found.testable) == "mixture"
    (chain,) = forward_selection(strategy, (), found)
    assert set(chain.effects) == {"wave", "step"}
