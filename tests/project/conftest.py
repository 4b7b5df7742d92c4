"""A pipeline of three quick steps that has run."""

from __future__ import annotations

import shutil
from pathlib import Path

import pytest

from tests.project.pipeline_runs import UNDIAGNOSED, run


@pytest.fixture(scope="session")
def done(tmp_path_factory: pytest.TempPathFactory, root: Path) -> Path:
    """A pipeline of three fast steps that has run, in its own folder: ``configs`` and ``out``.

    Without diagnosis: the pipeline handles its steps in the same way, in a tenth of the time.
    """
    folder = tmp_path_factory.mktemp("done")
    configs = folder / "configs"
    configs.mkdir()
    (folder / "sample_logs").symlink_to(root / "sample_logs")
    for name in ("vehicle", "area", "cg", "tire"):
        text = (root / "configs" / f"{name}.yaml").read_text()
        (configs / f"{name}.yaml").write_text(text + (UNDIAGNOSED if name in ("cg", "tire") else ""))
    steps = "".join(f"  - {name}.yaml\n" for name in ("tire", "cg", "area"))
    (configs / "pipeline.yaml").write_text(f"pipeline: a day\nvehicle: vehicle.yaml\nsteps:\n{steps}")
    assert run(configs, "out")[0] == 0
    return folder


@pytest.fixture
def day(done: Path, tmp_path: Path) -> Path:
    """The configs of a copy of that pipeline."""
    return shutil.copytree(done, tmp_path / "day", symlinks=True) / "configs"
