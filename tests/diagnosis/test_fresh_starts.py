"""Fits of delays start away from zero, and afresh where the baseline imitates the effect by its unknowns."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast
from unittest import mock

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.strategies.nested_fits import NestedFits, _strained
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.inference import Unknown
from vdyn_cli.inference.restrict import restricted

DELAYS = [-0.01, 0.01, -0.025, 0.025, -0.0625, 0.0625, -0.15625, 0.15625]


@pytest.mark.parametrize(
    ("late", "reach", "starts"), [(True, 20.0, DELAYS), (True, 0.02, DELAYS[:4]), (False, 20.0, [])]
)
def test_delays_start_at_several_sizes_within_their_range(late: bool, reach: float, starts: list[float]) -> None:
    strategy = open_strategy(Campaign(31).setup(cause("wave", late=late, reach=reach)))
    assert isinstance(strategy, NestedFits)
    regression = restricted(strategy.model.regression, strategy.model.held(("wave",)))
    tried = strategy._starts(regression, ("wave",), shapes=False)
    assert [next(u.start for u in one.unknowns if u.name == "wave") for one in tried] == pytest.approx(starts)


@pytest.mark.parametrize(("level", "from_the_step"), [(2.0, True), (30.0, False)])
def test_a_strained_baseline_hands_no_values_to_the_further_starts(level: float, from_the_step: bool) -> None:
    campaign = Campaign(31, priors={"level": (30.0, 1.0)}, hidden={"level": level})
    strategy = open_strategy(campaign.setup(cause("wave", late=True)))
    assert isinstance(strategy, NestedFits)
    with mock.patch.object(type(strategy), "_starts", return_value=()) as starts:
        strategy.fitted(("wave",))
    begun = {u.name: u.start for u in starts.call_args.args[0].unknowns}
    assert (begun["level"] == 0.0) is from_the_step


@pytest.mark.parametrize(("mass", "effects", "strained"), [(57.0, (), True), (85.0, (), False), (57.0, ("x",), False)])
def test_a_baseline_is_strained_by_an_unknown_far_from_its_prior(
    mass: float, effects: tuple[str, ...], strained: bool
) -> None:
    shared = (Unknown("mass", 86.0, prior=(86.0, 1.0)), Unknown("stiffness", 4e4))
    fitted = SimpleNamespace(effects=effects, values={"mass": mass, "stiffness": 1e4})
    assert _strained(*cast(Any, (SimpleNamespace(shared=shared), fitted))) is strained
