"""Fixtures shared by all tests."""

from __future__ import annotations

import gc
import os
from collections.abc import Iterator
from contextlib import suppress
from importlib import import_module
from pathlib import Path

import pytest
from hypothesis import settings

from tests.known_failures import KNOWN_FAILURES

ROOT = Path(__file__).resolve().parent.parent

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

# A busy machine makes no example wrong.
settings.register_profile("without deadline", deadline=None)
settings.load_profile("without deadline")


# The files that take longest start first, so that the parallel processes end together.
LONGEST = (
    "test_coastdown_diagnosis.py",
    "test_validate_open_road.py",
    "test_contract.py",
    "test_recovered_bump.py",
    "test_recovery.py",
    "test_changed_car.py",
    "test_coastdown.py",
    "test_road_noise.py",
    "test_damage.py",
    "test_bmw_diagnosis.py",
    "test_bmw_single_trip.py",
    "test_sample_day.py",
    "test_diagnose_first.py",
    "test_puzzle.py",
    "test_nondifferentiable.py",
    "test_check.py",
    "test_differential.py",
    "test_recovered_cg.py",
    "test_bump.py",
    "test_diagnose_first_validate.py",
    "test_plant_hidden.py",
    "test_validate.py",
    "test_trusted_results.py",
    "test_contracts.py",
    "test_day_plan.py",
    "test_init.py",
    "test_hidden.py",
    "test_recovered_tire.py",
    "test_recovered_shaft.py",
    "test_refused_baseline.py",
    "test_bmw_cuts.py",
    "test_rough_road.py",
    "test_bmw_i3.py",
    "test_plant_bump.py",
    "test_area.py",
    "test_cg.py",
    "test_felt_road.py",
    "test_plant_drive.py",
    "test_intervals.py",
    "test_channels.py",
    "test_run_pipeline.py",
    "test_fmu.py",
    "test_two_loggers.py",
    "test_plant_coast.py",
    "test_plant_parts.py",
)


def pytest_configure(config: pytest.Config) -> None:
    """Keep our order: pytest-xdist would start with the files of most tests, which are the quick ones."""
    if hasattr(config.option, "loadscopereorder"):
        config.option.loadscopereorder = False


def pytest_collection(session: pytest.Session) -> None:
    """Of all tests in parallel processes, each process compiles a share, and reads the others from the cache of Python.

    To rewrite the assertions of all modules takes half of the collection's time.
    """
    config = session.config
    count = int(os.environ.get("PYTEST_XDIST_WORKER_COUNT", "1"))
    if count == 1 or config.args_source == config.ArgsSource.ARGS:
        return
    own = int(os.environ["PYTEST_XDIST_WORKER"].removeprefix("gw"))
    for path in sorted(ROOT.glob("tests/**/test_*.py"))[own::count]:
        with suppress(Exception, pytest.skip.Exception):  # the collection imports it again, and reports it
            import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """The longest files first; what is known not to be reached is expected to fail, and no part of every run."""
    place = {name: number for number, name in enumerate(LONGEST)}
    items.sort(key=lambda item: place.get(item.path.name, len(place)))
    for item in items:
        if item.name in KNOWN_FAILURES:
            item.add_marker(pytest.mark.thorough)
            item.add_marker(pytest.mark.xfail(reason=KNOWN_FAILURES[item.name], strict=False))


def pytest_collection_finish() -> None:
    """Leave all that is imported now out of the searches for cycles of references, which take 5 % of the time."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(10_000, 20, 20)


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
