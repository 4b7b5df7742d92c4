"""Random damage to descriptions and logs: a result or a clear error, whatever is in the files; nothing half-written."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from tests.damage import damaged_bytes, damaged_text, logs_of, small_day, survives
from vdyn_cli import steps

quick = settings(
    max_examples=8,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)


OTHERS = [name for name in steps.names() if name != "bump"]


@pytest.fixture(scope="module")
def day(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """Small copies of the sample descriptions and their logs, in one folder."""
    return small_day(root, tmp_path_factory.mktemp("day"))


@pytest.mark.parametrize("step", ["bump", *(pytest.param(n, marks=pytest.mark.slow) for n in OTHERS)])
@quick
@given(st.integers(0, 2**32 - 1))
def test_a_damaged_description_gives_a_result_or_a_clear_error(step: str, day: Path, seed: int) -> None:
    chance = random.Random(seed)
    path = day / f"{step}.yaml"
    good = path.read_text(encoding="utf-8")
    try:
        path.write_text(damaged_text(good, chance), encoding="utf-8", errors="replace")
        survives(step, day)
    finally:
        path.write_text(good, encoding="utf-8")


@pytest.mark.slow
@pytest.mark.parametrize(
    "step",
    [pytest.param(n, marks=[pytest.mark.thorough] if n == "cg" else []) for n in steps.names()],  # cg: 9 s
)
@quick
@given(st.integers(0, 2**32 - 1))
def test_a_damaged_log_gives_a_result_or_a_clear_error(step: str, day: Path, seed: int) -> None:
    chance = random.Random(seed)
    logs = logs_of(step, day)
    if not logs:
        return
    path = day / chance.choice(logs)
    good = path.read_bytes()
    try:
        path.write_bytes(damaged_bytes(good, chance))
        survives(step, day)
    finally:
        path.write_bytes(good)
