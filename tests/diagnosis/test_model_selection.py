"""A profile with many unknowns is the answer only if no simpler law and no free force is nearly as good."""

from __future__ import annotations

from collections.abc import Sequence
from types import SimpleNamespace
from typing import Any

import pytest

from tests.diagnosis.linear import Campaign, cause
from vdyn_cli.diagnosis.name import model_selection
from vdyn_cli.diagnosis.name.candidate_judgment import _certain_part, judge
from vdyn_cli.diagnosis.name.candidate_models import CandidateModel, candidate_model
from vdyn_cli.diagnosis.name.model_selection import (
    _one_profile_suffices,
    _with_certain_effects,
    may_be_zero,
    nearly_sufficient,
    simplest,
    worse_than_alone,
)
from vdyn_cli.diagnosis.strategies.full_model import FullModel
from vdyn_cli.diagnosis.strategies.strategy_choice import open_strategy
from vdyn_cli.diagnosis.verdict_text import verdict_sentence

HILLS = cause("hills", tuple(f"shape_{k}" for k in range(2, 7)))  # not all: all would be a level, too
WAVE, WIND = cause("wave"), cause("wind")


def model() -> FullModel:
    return open_strategy(Campaign(1).setup(WAVE, WIND, HILLS, profiles=())).model


def trial(causes: Sequence[str], cost: float, rest: float) -> CandidateModel:
    fitted: Any = SimpleNamespace(solution=SimpleNamespace(cost=cost))
    return CandidateModel(tuple(causes), fitted, rest, None, 1.0)


def chosen(*tried: CandidateModel) -> list[tuple[str, ...]]:
    return [t.effects for t in simplest(model(), tuple(t for t in tried if t.sufficient), tried)]


def test_what_is_simple_and_suffices_goes_first():
    assert chosen(trial(["wave"], 104.0, 0.3), trial(["hills"], 95.0, 0.5)) == [("wave",)]


def test_a_profile_that_is_better_by_luck_gives_way_to_what_misses_little():
    """Four more unknowns lower twice the cost by four on average, and by 14 once in 140 times."""
    assert chosen(trial(["wave"], 102.0, 0.01), trial(["hills"], 95.0, 0.5)) == [("wave",)]


def test_a_profile_that_is_much_better_stands():
    assert chosen(trial(["wave"], 120.0, 0.01), trial(["hills"], 95.0, 0.5)) == [("hills",)]


def test_what_misses_too_much_is_no_answer_however_simple():
    assert chosen(trial(["wave"], 104.0, 0.001), trial(["hills"], 95.0, 0.5)) == [("hills",)]


def test_a_free_force_that_does_as_well_makes_it_unknown():
    """An unexplained residual is not named a road profile merely because a profile can have any shape."""
    force = cause("hat")
    campaign = Campaign(5, hidden={"hat": 4.0})
    assert judge(open_strategy(campaign.setup(WAVE, HILLS, profiles=()))).verdict == "named"
    free = campaign.setup(WAVE, HILLS, profiles=(force,))
    verdict = judge(open_strategy(free))
    assert verdict.verdict == "unknown"
    assert "A hills come closest, but a free profile with fewer unknowns fits equally well" in verdict_sentence(
        verdict, free.candidates, {}
    )


def test_an_effect_that_may_as_well_be_zero_is_not_certain_enough():
    def fitted(cause: str, value: float, std: float) -> Any:
        solution = SimpleNamespace(values={cause: value}, std={cause: std})
        return SimpleNamespace(effects=(cause,), solution=solution)

    assert may_be_zero(model(), fitted("wind", -1.0, 0.6))
    assert not may_be_zero(model(), fitted("wind", -1.3, 0.6))
    assert not may_be_zero(model(), fitted("hills", 0.0, 1.0))  # of many unknowns no one speaks for all


@pytest.mark.parametrize(("waves", "kept"), [(4.0, ("wave",)), (0.3, None)])
def test_an_effect_is_certain_although_one_beside_it_may_be_zero(waves: float, kept: tuple[str, ...] | None):
    """Without the other, it is the answer if it explains most of the misfit, of which bumps are a part."""
    strategy = open_strategy(Campaign(1, hidden={"wave": waves, "bump": 1.0}).setup(WAVE, WIND))
    answer = candidate_model(strategy, ("wave", "wind"))
    assert answer is not None
    found = _certain_part(strategy, answer)
    assert (found and found.effects) == kept


def left(cause: str, share: float, within: bool) -> CandidateModel:
    fitted: Any = SimpleNamespace(solution=SimpleNamespace(cost=1.0))
    return CandidateModel((cause,), fitted, 0.001, "profile", share, within)


def test_a_law_of_slightly_another_shape_is_named_in_its_own_part_only():
    assert [t.effects for t in nearly_sufficient([left("wave", 0.08, True), left("wind", 0.5, True)])] == [("wave",)]
    assert nearly_sufficient([left("wave", 0.08, False)]) == ()
    assert nearly_sufficient([left("wave", 0.02, False)])
    assert nearly_sufficient([left("wave", 0.12, True)]) == ()


def test_what_leaves_hardly_more_is_an_answer_too():
    """The residual is the error of a law: of two laws with nearly the same residual, neither is better."""
    tried = [left("wave", 0.06, True), left("wind", 0.10, False), left("hills", 0.11, True)]
    assert [t.effects for t in nearly_sufficient(tried)] == [("wave",), ("wind",)]


def test_a_learned_law_that_leaves_most_of_the_misfit_is_not_named():
    """Four fifths of the squares must be explained: 0.447 of the rms may remain."""
    assert left("law", 0.44, True).explains_most
    assert not left("law", 0.94, True).explains_most


@pytest.mark.parametrize(("error", "worse"), [(0.3, False), (1.8, True)])
def test_an_answer_of_two_effects_predicts_about_as_well_as_one_of_them_alone(
    error: float, worse: bool, monkeypatch: pytest.MonkeyPatch
):
    """Where the baseline is far off; ``error`` is the rms error of the exact fit of both effects."""
    errors = {("slip",): 2.6, ("drag",): 0.29, ("slip", "drag"): error}

    class Strategy:
        def __init__(self, far_off: bool) -> None:
            self.model = SimpleNamespace(setup=SimpleNamespace(far_off=far_off))

        def fitted(self, effects: tuple[str, ...]) -> Any:
            return SimpleNamespace(effects=effects)

        def relinearized(self, fitted: Any) -> Any:
            return SimpleNamespace(runs=errors[fitted.effects])

    monkeypatch.setattr(model_selection, "rms_of", lambda runs: runs)
    answer: Any = SimpleNamespace(effects=("slip", "drag"), fitted=SimpleNamespace(effects=("slip", "drag")))
    far: Any = Strategy(far_off=True)
    near: Any = Strategy(far_off=False)
    assert worse_than_alone(far, answer) is worse
    assert not worse_than_alone(near, answer)


def test_a_profile_that_a_candidate_beats_does_not_suffice():
    """Sign flips of a few blocks may not show what the profile leaves; the likelihood does."""
    strategy = open_strategy(Campaign(5, hidden={"hat": 4.0}).setup(WAVE, profiles=(cause("hat"),)))
    profile = strategy.fitted(("hat",))
    assert profile is not None
    cost = profile.solution.cost
    assert _one_profile_suffices(strategy, trial(["wave"], cost + 50.0, 0.001))
    assert not _one_profile_suffices(strategy, trial(["wave"], cost - 50.0, 0.001))


@pytest.mark.parametrize(
    ("p", "share", "std", "added"),
    [(0.03, 0.3, 0.1, True), (0.3, 0.3, 0.1, False), (0.03, 0.05, 0.1, False), (0.03, 0.3, 0.2, False)],
)
def test_an_answer_includes_what_its_residual_shows_with_certainty(
    p: float, share: float, std: float, added: bool, monkeypatch: pytest.MonkeyPatch
):
    """A further effect of ten standard errors across blocks, not one of five; and none beside a small residual."""
    late: Any = SimpleNamespace(effects=("late",), residual_p=p, residual_share=share, unphysical="")
    both: Any = SimpleNamespace(effects=("late", "filter"), residual_p=0.4, unphysical="", fitted=None)
    solution = SimpleNamespace(values={"late": -1.0, "filter": 1.0}, std={"late": 0.01, "filter": std})
    strategy: Any = SimpleNamespace(
        model=SimpleNamespace(amplitudes=lambda effect: (effect,)),
        relinearized=lambda fitted: SimpleNamespace(solution=solution),
        about=lambda fitted: strategy,
    )
    monkeypatch.setattr(model_selection, "with_next", lambda strategy, tried: both)
    assert _with_certain_effects(strategy, late) is (both if added else None)
