"""The slope at zero slip, where the tire's curve has another shape than the fitted one."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.effects import catalog
from vdyn_cli.inference import Unknown
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.quantities.result import Result
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.step import STEP

SLOPE, PEAK = 20.0, 0.9


def brush(slip: np.ndarray) -> np.ndarray:
    """Brush model with a parabolic pressure: adhesion up to slip 3 PEAK / SLOPE, then sliding throughout."""
    y = np.minimum(SLOPE * np.abs(slip) / (3 * PEAK), 1.0)
    return np.sign(slip) * PEAK * (3 * y - 3 * y**2 + y**3)


def straight_then_sliding(slip: np.ndarray) -> np.ndarray:
    """Dugoff's law: straight up to half of the peak, where its curvature has a step that no smooth form follows."""
    y = np.minimum(PEAK / (2 * SLOPE * np.maximum(np.abs(slip), 1e-9)), 1.0)
    return SLOPE * slip * y * (2 - y)


def formula(slip: np.ndarray) -> np.ndarray:
    return PEAK * np.sin(1.5 * np.arctan(SLOPE / (1.5 * PEAK) * slip))


def estimated(law) -> Result:
    rng = np.random.default_rng(3)
    time = np.arange(0.0, 8.0, 0.01)
    logs = []
    for k in range(4):
        slip = (-1) ** k * 0.3 * np.sin(np.pi * time / 8.0) ** 2
        load = np.full(time.size, 4000.0 + 200.0 * k)
        read = {"slip": slip + 5e-4 * rng.standard_normal(time.size)}
        read["force_x"] = law(slip) * load + 30.0 * rng.standard_normal(time.size)
        logs.append(Log(f"sweep_{k}.csv", time, {**read, "force_z": load + 30.0 * rng.standard_normal(time.size)}))
    return STEP.estimate(TireSpec.model_validate({"test": "tire"}), tuple(logs), Parameters())


@pytest.mark.parametrize(
    ("law", "widest"),
    [
        *(pytest.param(law, w, marks=pytest.mark.slow) for law, w in ((brush, 0.25), (straight_then_sliding, 0.35))),
        (formula, 0.02),
    ],
)
def test_the_interval_holds_the_slope_of_the_measured_friction(law, widest: float) -> None:
    result = estimated(law)
    low, high = result.parameters["tire_longitudinal_stiffness"].interval95
    assert low < SLOPE < high
    assert any("departs from the magic formula" in w for w in result.fit.warnings) == (law is brush)
    assert high - low < widest * SLOPE


@pytest.mark.slow  # 2 s
def test_a_relaxation_length_changes_neither_slope_nor_curve() -> None:
    logs, rng = [], np.random.default_rng(4)
    time = np.arange(0.0, 8.0, 0.01)
    for k in range(4):
        slip = (-1) ** k * 0.3 * np.clip(np.minimum(time - 1.0, 7.0 - time) / 3.0, 0.0, 1.0)
        felt = np.zeros(time.size)
        for i in range(1, time.size):
            left = np.exp(-0.01 * 10.0 / 1.5)
            felt[i] = left * felt[i - 1] + (1.0 - left) * (slip[i] + slip[i - 1]) / 2
        read = {"slip": slip, "force_x": formula(felt) * 4000.0, "vehicle_speed": np.full(time.size, 10.0)}
        noise = {"slip": 5e-4, "force_x": 30.0, "vehicle_speed": 0.05}
        read = {n: v + noise[n] * rng.standard_normal(time.size) for n, v in read.items()}
        logs.append(Log(f"sweep_{k}.csv", time, {**read, "force_z": 4000.0 + 30.0 * rng.standard_normal(time.size)}))
    problem = STEP.prepare(TireSpec.model_validate({"test": "tire"}), tuple(logs), Parameters())
    relaxation = next(e for e in catalog() if e.name == "tire_relaxation")
    result = problem.publish(
        AddedEffects((relaxation,), tuple(Unknown(n, 0.0, -3.0, 3.0, "m") for n in relaxation.unknowns))
    )
    assert not [w for w in result.fit.warnings if "fit this tire" in w or "departs" in w]
    assert result.amplitudes["tire_relaxation"].value == pytest.approx(1.5, rel=0.01)
    assert result.parameters["tire_B"].value == pytest.approx(SLOPE / (1.5 * PEAK), rel=0.02)
