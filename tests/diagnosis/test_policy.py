"""Every threshold has a meaning and a reason, and is printed."""

from __future__ import annotations

from dataclasses import fields

import pytest

from vdyn_cli.commands.explain import explanation
from vdyn_cli.diagnosis.policy import POLICY, shared_level
from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.steps.step_policy import STEP_POLICY


@pytest.mark.parametrize(
    ("one", "policy", "text"),
    [
        (one, policy, text)
        for policy in (POLICY, QUALITY, CLOCKS, CHECK, STEP_POLICY)
        for text in [explanation("policy")]
        for one in fields(policy)
    ],
    ids=lambda f: getattr(f, "name", ""),
)
def test_every_threshold_has_a_meaning_and_a_reason(one, policy, text) -> None:  # type: ignore[no-untyped-def]
    assert len(one.metadata["meaning"]) > 10
    assert len(one.metadata["reason"]) > 10
    assert one.metadata["reason"].endswith(".")
    assert f"{one.name} = {getattr(policy, one.name):g}" in text


def test_a_pipeline_shares_the_level_as_the_option_can_state_it() -> None:
    assert shared_level(1) == POLICY.level
    assert shared_level(7) == 0.007143
