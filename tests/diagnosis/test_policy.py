"""Every threshold says what it is and why, and is printed."""

from __future__ import annotations

from dataclasses import fields

import pytest

from vdyn_cli.diagnosis.policy import POLICY, policy_text, shared_level


@pytest.mark.parametrize("one", fields(POLICY), ids=lambda f: f.name)
def test_every_threshold_has_a_meaning_and_a_reason(one) -> None:  # type: ignore[no-untyped-def]
    assert len(one.metadata["meaning"]) > 10
    assert len(one.metadata["reason"]) > 10
    assert one.metadata["reason"].endswith(".")
    assert f"{one.name} = {getattr(POLICY, one.name):g}" in policy_text()


def test_a_pipeline_shares_the_level_as_the_option_can_state_it() -> None:
    assert shared_level(1) == POLICY.level
    assert shared_level(7) == 0.007143
