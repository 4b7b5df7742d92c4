"""A part replaces an answer that leaves much of what the part explains, but not one that leaves only noise."""

from __future__ import annotations

from types import SimpleNamespace as Some
from typing import Any, cast

import pytest

from tests.messy_cases import diagnosed_case
from tests.plant import messy_day
from vdyn_cli.diagnosis.part import part_judgment
from vdyn_cli.diagnosis.part.part_judgment import _equalled, _imitates, _naming_law, _surpassed


@pytest.mark.parametrize(
    ("explained", "sufficient", "effects", "surpassed"),
    [
        (50.0, False, ("one",), True),
        (88.0, True, ("one", "two"), False),
        (88.0, True, ("one", "two", "three"), True),
        (99.0, True, ("one", "two", "three"), False),
        (None, True, ("one",), False),
        (None, False, ("one",), True),
    ],
    ids=["half", "most by two", "most by three", "all by three", "refused, noise left", "refused, more left"],
)
def test_a_part_surpasses_an_answer_that_leaves_much_or_needs_many_effects(
    explained: float | None, sufficient: bool, effects: tuple[str, ...], surpassed: bool
) -> None:
    fits = {"part": 100.0, "answer": explained}
    search = Some(
        floor=1.0,
        with_effects=lambda effects: None if fits["answer"] is None else "answer",
        explained=lambda fitted: fits[fitted],
    )
    judgment = Some(answers=(Some(effects=effects, sufficient=sufficient),))
    finding = Some(search=search, fitted="part")
    assert _surpassed(*cast(Any, (judgment, finding))) is surpassed


@pytest.mark.parametrize(
    ("cost", "sufficient", "equalled"), [(11.0, True, True), (99.0, True, False), (11.0, False, False)]
)
def test_a_law_replaces_no_other_answer_that_leaves_only_noise_and_fits_as_well(
    cost: float, sufficient: bool, equalled: bool
) -> None:
    law = Some(effects=("law",), cost=10.0)
    judgment = Some(answers=(law, Some(effects=("other",), cost=cost, sufficient=sufficient)))
    law.sufficient = True
    assert _equalled(*cast(Any, (judgment, law))) is equalled


@pytest.mark.parametrize(("least", "named"), [(0.13, True), (0.12, False)], ids=["better", "as the answer"])
def test_a_learned_law_that_predicts_no_better_than_an_answer_is_not_named(
    least: float, named: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    class Judged(Some):
        def naming(self, answer: object, gain: object) -> str:
            return "named"

    replaced = {
        "open_strategy": lambda setup: Some(base="base"),
        "candidate_model": lambda strategy, effects: Some(explains_most=True, unphysical="", fitted="fitted"),
        "detect": lambda strategy, base: Some(scores=None, testable=()),
        "held_out_gain": lambda strategy, base, fitted: Some(before=0.38, after=0.12),
        "replace": lambda one, **changed: one,
    }
    for name, function in replaced.items():
        monkeypatch.setattr(part_judgment, name, function)
    strategy = Some(model=Some(setup=Some(effects=())))
    law = Some(effect=Some(), name="law")
    judged = _naming_law(
        *cast(Any, (strategy, Judged(answers=(), detection=None, tried=(), base="base"), law)), least=least, parts=1
    )
    assert (judged is not None) is named


@pytest.mark.parametrize(
    ("cost", "left", "parts", "imitates"),
    [(104.0, 0.5, 1, True), (108.0, 0.5, 1, False), (108.0, 0.5, 10, True), (104.0, 0.75, 1, False)],
    ids=["by chance", "clearly better", "by the chance of ten parts", "explains clearly less"],
)
def test_a_learned_law_with_more_unknowns_must_explain_more_than_chance_beside_an_answer(
    cost: float, left: float, parts: int, imitates: bool, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Two more unknowns: chance lowers twice the cost by more than 12.4 in 0.2 % of the cases."""
    same = Some(effects=("area",), cost=cost, residual_share=left)
    monkeypatch.setattr(part_judgment, "candidate_model", lambda strategy, effects: same)
    strategy = Some(model=Some(freed=lambda effect: ("a", "b", "c") if effect == "law" else (effect,)))
    law, answer = Some(effects=("law",), cost=100.0, residual_share=0.45), Some(effects=("area",))
    assert _imitates(*cast(Any, (strategy, law, answer, parts))) is imitates


@pytest.mark.slow  # a diagnosis of 4 s
@pytest.mark.thorough
def test_a_fading_brake_beside_a_road_is_named_though_its_fit_without_a_prior_reaches_its_bound() -> None:
    result = diagnosed_case(messy_day.drive(17_008, messy_day.drawn_day("fading", 17_008)), position=True)
    assert result.diagnosis is not None
    assert {c.effect for c in result.diagnosis.causes} == {"grade_profile", "brake_drag_fading"}
