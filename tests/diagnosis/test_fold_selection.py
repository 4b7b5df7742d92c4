"""A fold repeats the selection of effects: sufficient single effects before pairs."""

from __future__ import annotations

from dataclasses import replace

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.detect.detection import detect
from vdyn_cli.diagnosis.gain.fold_selection import Information, information, sufficient
from vdyn_cli.diagnosis.name.candidate_judgment import _scored
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy

NAMES = ("slope", "wind", "wave", "step")


def found(campaign: Campaign) -> Information:
    strategy = open_strategy(campaign.setup(*(cause(n) for n in NAMES)))
    base = strategy.fitted(())
    assert base is not None
    model = strategy.model
    every = {n: model.amplitudes(n) for n in (*NAMES, *model.setup.free_profiles)}
    made = information(base.system, model.base_unknowns, every, list(model.setup.free_profiles))
    scored = model.scores(base, [*NAMES, *model.setup.free_profiles])
    for name in every:  # the same statistics as the score test
        assert made.statistic(name)[0] == pytest.approx(scored.statistic[name], rel=1e-4, abs=1e-6)
        assert made.statistic(name)[1] == scored.rank[name]
    return made


@pytest.mark.parametrize(("wave", "tested"), [(0.0, ("slope",)), (3.0, ("slope", "wave"))])
def test_a_delay_without_evidence_at_zero_is_not_selected_there(wave: float, tested: tuple[str, ...]) -> None:
    """Only a fit of its own shows a delay beyond the duration of a step, and folds select by scores at zero."""
    hidden = {"slope": 3.0, "wave": wave}
    strategy = open_strategy(Campaign(31, hidden=hidden).setup(cause("slope"), cause("wave", late=True), cause("wind")))
    found = replace(detect(strategy, strategy.base), testable=("slope", "wave"))
    assert _scored(strategy, found) == tested


def test_nothing_is_chosen_where_nothing_is() -> None:
    quiet = [sufficient(found(Campaign(900 + seed)), NAMES, 2) for seed in range(6)]
    assert quiet.count(()) >= 4  # two standard errors are exceeded by chance now and then


@pytest.mark.parametrize(("hidden", "size"), [("slope", 0.8), ("wind", 2.0), ("step", 1.5)])
def test_one_that_suffices_is_chosen(hidden: str, size: float) -> None:
    assert sufficient(found(Campaign(7, hidden={hidden: size})), NAMES, 2) == (hidden,)


def test_a_pair_is_chosen_only_where_the_answer_has_two() -> None:
    both = found(Campaign(4, hidden={"slope": 0.8, "wave": 1.2}))
    assert sufficient(both, NAMES, 2) == ("slope", "wave")
    assert sufficient(both, NAMES, 1) is None


def test_beside_an_effect_the_others_are_scored_as_in_a_fit_with_it() -> None:
    campaign = Campaign(4, hidden={"slope": 0.8, "wave": 1.2})
    strategy = open_strategy(campaign.setup(*(cause(n) for n in NAMES)))
    one = strategy.fitted(("slope",))
    assert one is not None
    scored = strategy.model.scores(one, ["wave"])
    assert found(campaign).beside(["slope"]).statistic("wave")[0] == pytest.approx(scored.statistic["wave"], rel=1e-4)
