"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path

import pytest

from tests.known_failures import KNOWN_FAILURES

ROOT = Path(__file__).resolve().parent.parent

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


# The files that take longest start first, so that the parallel processes end together.
LONGEST = (
    "test_sample_day.py",
    "test_coastdown_diagnosis.py",
    "test_contract.py",
    "test_puzzle.py",
    "test_next_test.py",
    "test_cli.py",
    "test_coastdown.py",
    "test_validate_open_road.py",
    "test_bmw_diagnosis.py",
    "test_bmw_i3.py",
    "test_run_pipeline.py",
    "test_validate.py",
    "test_damage.py",
)


def pytest_configure(config: pytest.Config) -> None:
    """Keep our order: pytest-xdist would start with the files of most tests, which are the quick ones."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first; what is known not to be reached is expected to fail."""
    items.sort(key=lambda item: item.path.name not in LONGEST)
    for item in items:
        if item.name in KNOWN_FAILURES:
            item.add_marker(pytest.mark.xfail(reason=KNOWN_FAILURES[item.name], strict=False))


def shared_data_folder() -> Path:
    """Where real measurements are looked for: $VDYN_DATA, or ../shared/data beside the project."""
    return Path(os.environ.get("VDYN_DATA") or ROOT.parent / "shared" / "data")


@pytest.fixture(scope="session")
def shared_data() -> Path:
    folder = shared_data_folder()
    if not folder.is_dir():
        pytest.skip(f"real measurements are not at {folder} (set VDYN_DATA to where they are)")
    return folder


@pytest.fixture(scope="session")
def root() -> Path:
    return ROOT


@pytest.fixture(scope="session", autouse=True)
def _written_results_follow_their_schema() -> Iterator[None]:
    """Every result that a command writes in this process is checked against the schema that it publishes."""
    from tests.result_check import checked
    from vdyn_cli.commands import run_pipeline, run_step

    with pytest.MonkeyPatch.context() as patch:
        for module in (run_step, run_pipeline):
            patch.setattr(module, "to_json", checked(module.to_json))
        yield
