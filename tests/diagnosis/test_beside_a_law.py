"""A further effect only corrects the shape of a law of the part at fault; beside a profile it is separate.

So is one that explains what no curve of the part does.
"""

from __future__ import annotations

from types import SimpleNamespace as Some
from typing import Any, cast

import pytest

from vdyn_cli.diagnosis.part.part_judgment import _beside_a_law

CURVE = 100.0  # squares that the part's free curve explains


@pytest.mark.parametrize(
    ("unknowns", "explained", "mends"),
    [(1, 104.0, True), (36, 104.0, False), (1, 160.0, False)],
    ids=["law", "profile", "another part"],
)
def test_a_second_effect_mends_a_law_but_not_a_profile(unknowns: int, explained: float, mends: bool) -> None:
    names = tuple(f"a{k}" for k in range(unknowns))
    strategy = Some(model=Some(amplitudes=lambda effect: names if effect == "first" else ("b",)))
    judgment = Some(answers=(Some(effects=("first", "second")),))
    search = Some(floor=1.0, explained=lambda fitted: fitted, with_effects=lambda effects: explained)
    finding = Some(laws=(Some(effect="first", follows=True),), search=search, fitted=CURVE)
    assert _beside_a_law(*cast(Any, (strategy, judgment, finding))) is mends
