"""Every threshold has a meaning and a reason, and is printed."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import pytest

from vdyn_cli.commands.explain import explanation
from vdyn_cli.diagnosis.policy import POLICY, shared_level
from vdyn_cli.io.clocks.clock_policy import CLOCKS
from vdyn_cli.io.quality.quality_policy import QUALITY
from vdyn_cli.project.checks.check_policy import CHECK
from vdyn_cli.quantities.threshold import described_thresholds
from vdyn_cli.steps import load_step, names
from vdyn_cli.steps.step_policy import STEP_POLICY

OF_STEPS = [policy for name in names() if (policy := load_step(name).policy) is not None]
ALL = [POLICY, QUALITY, CLOCKS, CHECK, STEP_POLICY, *OF_STEPS]


@pytest.mark.parametrize("policy", ALL, ids=lambda p: type(p).__name__)
def test_every_threshold_has_a_meaning_and_a_reason_and_is_printed(policy: Any) -> None:
    described, text = described_thresholds(type(policy)), explanation("policy")
    assert list(described) == [one.name for one in fields(policy)]
    for name, one in described.items():
        assert min(len(one.meaning), len(one.reason)) > 10
        assert one.reason.endswith(".")
        assert f"{name} = {getattr(policy, name):g}" in text


def test_a_pipeline_shares_the_level_as_the_option_can_state_it() -> None:
    assert shared_level(1) == POLICY.level
    assert shared_level(7) == 0.007143
