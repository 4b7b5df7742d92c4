"""A further effect only corrects the shape of a law of the part at fault; beside a profile it is separate."""

from __future__ import annotations

from types import SimpleNamespace as Some
from typing import Any, cast

import pytest

from vdyn_cli.diagnosis.part.part_judgment import _beside_a_law


@pytest.mark.parametrize(("unknowns", "mends"), [(1, True), (36, False)], ids=["law", "profile"])
def test_a_second_effect_mends_a_law_but_not_a_profile(unknowns: int, mends: bool) -> None:
    names = tuple(f"a{k}" for k in range(unknowns))
    strategy = Some(model=Some(amplitudes=lambda effect: names if effect == "first" else ("b",)))
    judgment = Some(answers=(Some(effects=("first", "second")),))
    finding = Some(laws=(Some(effect="first", follows=True),))
    assert _beside_a_law(*cast(Any, (strategy, judgment, finding))) is mends
