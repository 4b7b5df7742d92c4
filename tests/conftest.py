"""Fixtures shared by all tests."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


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
