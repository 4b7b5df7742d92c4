"""A slip that a rig logs late: found as a time lag, and the curve is the truth's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.plant.tire import friction
from vdyn_cli.project.execute import execute

CURVE = (12.0, 1.55, 0.98, 0.1)
LOAD, LATE, RATE = 4000.0, 0.03, 100.0


def sweep(seed: int, sign: int) -> np.ndarray:
    """(n, 4) time, slip, longitudinal and vertical force of a flat track, whose slip is logged late."""
    rng = np.random.default_rng(seed)
    time = np.arange(1200) / RATE

    def slip(t: np.ndarray) -> np.ndarray:
        return sign * 0.3 * np.clip(np.minimum(t % 6.0 - 1.0, 5.0 - t % 6.0) / 1.2, 0.0, 1.0)

    read = slip(time - LATE) + 1e-3 * rng.standard_normal(time.size)
    force = friction(slip(time), *CURVE) * LOAD + 12.0 * rng.standard_normal(time.size)
    return np.column_stack([time, read, force, LOAD + 12.0 * rng.standard_normal(time.size)])


@pytest.mark.slow  # half a minute of diagnosis
def test_a_slip_that_is_logged_late_is_named_and_leaves_the_curve(tmp_path: Path) -> None:
    for k in range(4):
        table = sweep(k, (-1) ** k)
        np.savetxt(tmp_path / f"{k}.csv", table, "%.5f", ",", header="t,SR,FX,FZ", comments="")
    columns = {"time": ("t", "s"), "slip": ("SR", "1"), "force_x": ("FX", "N"), "force_z": ("FZ", "N")}
    description = {
        "test": "tire",
        "channels": {name: {"column": c, "unit": u} for name, (c, u) in columns.items()},
        "runs": [{"log": f"{k}.csv"} for k in range(4)],
    }
    (tmp_path / "tire.yaml").write_text(yaml.safe_dump(description), encoding="utf-8")
    document = execute("tire", tmp_path / "tire.yaml").document
    assert document["diagnosis"]["verdict"] == "named"
    (cause,) = document["diagnosis"]["causes"]
    assert cause["effect"] == "slip_lag"
    assert cause["unknowns"]["slip_lag"]["value"] == pytest.approx(-LATE, rel=0.15)
    for name, truth in zip(("tire_B", "tire_C", "tire_D"), CURVE, strict=False):
        assert document["parameters"][name]["value"] == pytest.approx(truth, rel=0.02)
