"""Fits of effects start afresh where the baseline imitates the effect by its unknowns."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.strategies.nested_fits import NestedFits, _strained
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Unknown


@pytest.mark.parametrize(("late", "starts"), [(True, [0.0, -0.01, 0.01, -0.03, 0.03, -0.09, 0.09]), (False, [0.0])])
def test_delays_start_at_several_sizes(late: bool, starts: list[float]) -> None:
    strategy = open_strategy(Campaign(31).setup(cause("wave", late=late)))
    assert isinstance(strategy, NestedFits)
    tried = strategy._afresh(strategy.model.held(("wave",)), ("wave",))
    assert [next(u.start for u in one.unknowns if u.name == "wave") for one in tried] == pytest.approx(starts)


@pytest.mark.parametrize(("mass", "effects", "strained"), [(57.0, (), True), (85.0, (), False), (57.0, ("x",), False)])
def test_a_baseline_is_strained_by_an_unknown_far_from_its_prior(
    mass: float, effects: tuple[str, ...], strained: bool
) -> None:
    shared = (Unknown("mass", 86.0, prior=(86.0, 1.0)), Unknown("stiffness", 4e4))
    fitted = SimpleNamespace(effects=effects, values={"mass": mass, "stiffness": 1e4})
    assert _strained(*cast(Any, (SimpleNamespace(shared=shared), fitted))) is strained
