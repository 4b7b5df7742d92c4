"""A tread that loses friction while it slides: found per second of a sweep, and the curve is that of its start."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.plant.tire import friction
from vdyn_cli.project.execute import execute

CURVE = (12.0, 1.55, 0.98, 0.1)
LOAD, LOSS, RATE, SPEED, RADIUS = 4000.0, 0.01, 100.0, 13.0, 0.31  # N, 1/s, 1/s, m/s, m


def sweep(seed: int) -> np.ndarray:
    """(n, 5) time, wheel and vehicle speed, longitudinal and vertical force of two brakings."""
    rng = np.random.default_rng(seed)
    time = np.arange(1200) / RATE
    slip = -0.3 * np.clip(np.minimum((time % 6.0 - 1.0) / 3.0, 5.0 - time % 6.0), 0.0, 1.0)
    force = friction(slip, *CURVE) * LOAD * (1.0 - LOSS * time)
    noise = rng.standard_normal((4, time.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([SPEED * (1.0 + slip) / RADIUS, np.full(time.size, SPEED), force, np.full(time.size, LOAD)])
    return np.column_stack([time, *(read + noise)])


@pytest.mark.slow  # half a minute of diagnosis
def test_friction_that_falls_in_each_sweep_is_named_and_leaves_the_curve(tmp_path: Path) -> None:
    for k in range(4):
        np.savetxt(tmp_path / f"{k}.csv", sweep(k), "%.5f", ",", header="t,om,v,FX,FZ", comments="")
    columns = {"wheel_speed": ("om", "rad/s"), "vehicle_speed": ("v", "m/s"), "force_x": ("FX", "N")}
    columns |= {"time": ("t", "s"), "force_z": ("FZ", "N")}
    description = {
        "test": "tire",
        "vehicle": {"wheel_radius": f"{RADIUS} m"},
        "channels": {name: {"column": c, "unit": u} for name, (c, u) in columns.items()},
        "runs": [{"log": f"{k}.csv"} for k in range(4)],
    }
    (tmp_path / "tire.yaml").write_text(yaml.safe_dump(description), encoding="utf-8")
    document = execute("tire", tmp_path / "tire.yaml").document
    assert document["diagnosis"]["verdict"] == "named"
    (cause,) = document["diagnosis"]["causes"]
    assert cause["effect"] == "friction_drift"
    assert cause["unknowns"]["friction_drift"]["value"] == pytest.approx(-LOSS, rel=0.05)
    for name, truth in zip(("tire_B", "tire_C", "tire_D"), CURVE, strict=False):
        assert document["parameters"][name]["value"] == pytest.approx(truth, rel=0.02)
