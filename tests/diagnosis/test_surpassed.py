"""A part replaces an answer that leaves much of what the part explains, but not one that leaves only noise."""

from __future__ import annotations

from types import SimpleNamespace as Some
from typing import Any, cast

import pytest

from tests.messy_cases import diagnosed_case
from tests.plant import messy_day
from vdyn_cli.diagnosis.part.part_judgment import _surpassed


@pytest.mark.parametrize(
    ("explained", "sufficient", "surpassed"),
    [(50.0, False, True), (99.0, False, False), (None, True, False), (None, False, True)],
    ids=["half", "nearly all", "refused, noise left", "refused, more left"],
)
def test_a_part_surpasses_an_answer_that_leaves_much(
    explained: float | None, sufficient: bool, surpassed: bool
) -> None:
    fits = {"part": 100.0, "answer": explained}
    search = Some(
        floor=1.0,
        with_effects=lambda effects: None if fits["answer"] is None else "answer",
        explained=lambda fitted: fits[fitted],
    )
    judgment = Some(answers=(Some(effects=("one",), sufficient=sufficient),))
    finding = Some(search=search, fitted="part")
    assert _surpassed(*cast(Any, (judgment, finding))) is surpassed


@pytest.mark.slow  # a diagnosis of 4 s
@pytest.mark.thorough
def test_a_fading_brake_beside_a_road_is_named_though_its_fit_without_a_prior_reaches_its_bound() -> None:
    result = diagnosed_case(messy_day.drive(17_008, messy_day.drawn_day("fading", 17_008)), position=True)
    assert result.diagnosis is not None
    assert {c.effect for c in result.diagnosis.causes} == {"grade_profile", "brake_drag_fading"}
