"""A law of the part is named with a further effect that explains much of its residual."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace as Some
from typing import Any, cast

import pytest

from vdyn_cli.diagnosis.judgment import Judgment
from vdyn_cli.diagnosis.part import part_judgment
from vdyn_cli.diagnosis.part.part_judgment import _with_law

BEFORE = 10.0  # held-out rms of the baseline


def named(
    monkeypatch: pytest.MonkeyPatch, alone: float, both: float, most: bool = False, needed: bool = True
) -> tuple[str, ...]:
    """The effects that are named, with the held-out rms after the law alone, and after the law and one effect more."""
    law = Some(effects=("road",), fitted="road", unphysical="", sensor_fault=False, explains_most=most)
    more = Some(effects=("road", "brake"), fitted="both", unphysical="", sensor_fault=False, explains_most=True)
    after = {"road": alone, "both": both}
    stubs: dict[str, Callable[..., Any]] = {
        "candidate_model": lambda strategy, effects: law,
        "with_next": lambda strategy, answer: more,
        "all_needed": lambda strategy, answer: needed,
        "held_out_gain": lambda strategy, base, fitted: Some(
            before=BEFORE, after=after[fitted], positive=after[fitted] < BEFORE
        ),
    }
    for name, stub in stubs.items():
        monkeypatch.setattr(part_judgment, name, stub)
    judgment = Judgment(cast(Any, None), cast(Any, None), material=True)
    found = _with_law(cast(Any, None), judgment, cast(Any, Some(effect="road")))
    assert found is not None
    assert found.verdict == "named"
    return found.answers[0].effects


def test_both_are_named_where_held_out_runs_need_both(monkeypatch: pytest.MonkeyPatch) -> None:
    assert named(monkeypatch, alone=6.0, both=1.0) == ("road", "brake")


@pytest.mark.parametrize(
    "case",
    [
        {"alone": 6.0, "both": 7.0},
        {"alone": 6.0, "both": 1.0, "most": True},
        {"alone": 6.0, "both": 1.0, "needed": False},
    ],
    ids=["no gain", "the law leaves little", "not needed"],
)
def test_the_law_alone_is_named_else(monkeypatch: pytest.MonkeyPatch, case: dict[str, Any]) -> None:
    assert named(monkeypatch, **case) == ("road",)
