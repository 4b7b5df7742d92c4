"""Faults of slip sweeps that the diagnosis names, so that the curve is the truth's."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import yaml

from tests.plant.tire import friction
from vdyn_cli.diagnosis.strategies.effect_unknowns import unknowns_of
from vdyn_cli.effects import catalog
from vdyn_cli.project.execute import execute
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.parameters import Parameters
from vdyn_cli.steps.added_effects import AddedEffects
from vdyn_cli.steps.tire.problem import _with_likely_effect, prepare
from vdyn_cli.steps.tire.spec import TireSpec
from vdyn_cli.steps.tire.tire_regression import CAR_TIRES

CURVE = (12.0, 1.55, 0.98, 0.1)
LOAD, RATE = 4000.0, 100.0  # N, Hz
LOSS, SPEED, RADIUS = 0.01, 13.0, 0.31  # 1/s, m/s, m: a tread that loses friction while it slides
BRAKING = 0.1  # share by which the peak in braking exceeds that in driving
WEAR = 0.002  # 1/s of sweeping, by which a tread loses friction over the day
WARMING = 0.004  # 1/s of sweeping, by which a cold tread gains friction at first
LATE = 0.03  # s by which a rig logs its slip late
GPS_LATE = 0.12  # s by which the vehicle speed is logged late
GROWTH = 0.006  # share by which the rolling radius is larger at 100 km/h
RELAXATION = 0.35  # m that a tire rolls until its slip acts
TIME = np.arange(1200) / RATE


def braked(k: int) -> dict[str, np.ndarray]:
    """Two brakings, with speeds of wheel and vehicle."""
    rng = np.random.default_rng(k)
    slip = -0.3 * np.clip(np.minimum((TIME % 6.0 - 1.0) / 3.0, 5.0 - TIME % 6.0), 0.0, 1.0)
    force = friction(slip, *CURVE) * LOAD * (1.0 - LOSS * TIME)
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([SPEED * (1.0 + slip) / RADIUS, np.full(TIME.size, SPEED), force, np.full(TIME.size, LOAD)])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


def on_a_flat_track(k: int) -> dict[str, np.ndarray]:
    """Two sweeps in one direction, whose slip is logged late."""
    rng = np.random.default_rng(k)

    def slip(t: np.ndarray) -> np.ndarray:
        return (-1) ** k * 0.3 * np.clip(np.minimum(t % 6.0 - 1.0, 5.0 - t % 6.0) / 1.2, 0.0, 1.0)

    read = slip(TIME - LATE) + 1e-3 * rng.standard_normal(TIME.size)
    force = friction(slip(TIME), *CURVE) * LOAD + 12.0 * rng.standard_normal(TIME.size)
    return {"slip": read, "force_x": force, "force_z": LOAD + 12.0 * rng.standard_normal(TIME.size)}


def worn(k: int) -> dict[str, np.ndarray]:
    """A sweep of a tread that wears from sweep to sweep."""
    rng = np.random.default_rng(k)
    slip = 0.3 * np.sin(2 * np.pi * TIME / 12.0) * np.clip(TIME, 0.0, 1.0)
    day = TIME[-1] * k + TIME
    force = friction(slip, *CURVE) * LOAD * (1.0 - WEAR * day)
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([SPEED * (1.0 + slip) / RADIUS, np.full(TIME.size, SPEED), force, np.full(TIME.size, LOAD)])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


def warmed(k: int) -> dict[str, np.ndarray]:
    """A sweep of a tread that gains friction until it is warm, after some 20 s of sweeping."""
    rng = np.random.default_rng(k)
    slip = 0.3 * np.sin(2 * np.pi * TIME / 12.0) * np.clip(TIME, 0.0, 1.0)
    day = TIME[-1] * k + TIME
    force = friction(slip, *CURVE) * LOAD * (1.0 + WARMING * 20.0 * (1.0 - np.exp(-day / 20.0)))
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([SPEED * (1.0 + slip) / RADIUS, np.full(TIME.size, SPEED), force, np.full(TIME.size, LOAD)])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


def while_accelerating(k: int) -> dict[str, np.ndarray]:
    """A sweep of a vehicle that gains or loses speed, which a GPS gives late."""
    rng = np.random.default_rng(k)
    slip = 0.3 * np.sin(2 * np.pi * TIME / 12.0) * np.clip(TIME, 0.0, 1.0)
    speed = SPEED + (-1) ** k * 0.4 * (TIME - 6.0)
    late = speed - (-1) ** k * 0.4 * GPS_LATE
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([speed * (1.0 + slip) / RADIUS, late, friction(slip, *CURVE) * LOAD, np.full(TIME.size, LOAD)])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


def with_a_growing_radius(k: int) -> dict[str, np.ndarray]:
    """A sweep at a speed of its own, with a belt that grows; the radius is given for a low speed."""
    rng = np.random.default_rng(k)
    slip = 0.3 * np.sin(2 * np.pi * TIME / 12.0) * np.clip(TIME, 0.0, 1.0)
    speed = np.full(TIME.size, 8.0 + 7.0 * k)
    radius = RADIUS * (1.0 + GROWTH * (3.6 * speed / 100.0) ** 2)
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([speed * (1.0 + slip) / radius, speed, friction(slip, *CURVE) * LOAD, np.full(TIME.size, LOAD)])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


def with_two_peaks(k: int) -> dict[str, np.ndarray]:
    """A sweep under a load of its own, whose peak is higher in braking; the slope at zero slip is the same."""
    rng = np.random.default_rng(k)
    slip = 0.3 * np.sin(2 * np.pi * TIME / 12.0) * np.clip(TIME, 0.0, 1.0)
    load = LOAD * (0.85 + 0.1 * k) + 60.0 * np.sin(3.1 * TIME + k)
    b, c, d, e = CURVE
    braking = friction(slip, b / (1 + BRAKING), c, d * (1 + BRAKING), e)
    force = np.where(slip < 0, braking, friction(slip, *CURVE)) * load
    noise = rng.standard_normal((4, TIME.size)) * np.array([[0.05], [0.02], [12.0], [12.0]])
    read = np.array([SPEED * (1.0 + slip) / RADIUS, np.full(TIME.size, SPEED), force, load])
    return dict(zip(("wheel_speed", "vehicle_speed", "force_x", "force_z"), read + noise, strict=True))


@pytest.mark.slow  # a diagnosis of 4 s each
@pytest.mark.parametrize(
    ("sweep", "vehicle", "effect", "size", "tolerance"),
    [
        pytest.param(
            braked, {"wheel_radius": f"{RADIUS} m"}, "friction_drift", -LOSS, 0.05, marks=pytest.mark.thorough
        ),
        pytest.param(worn, {"wheel_radius": f"{RADIUS} m"}, "tread_wear", -WEAR, 0.05, marks=pytest.mark.thorough),
        (warmed, {"wheel_radius": f"{RADIUS} m"}, "tread_wear", WARMING, 0.1),
        (with_two_peaks, {"wheel_radius": f"{RADIUS} m"}, "braking_friction", BRAKING, 0.05),
        (while_accelerating, {"wheel_radius": f"{RADIUS} m"}, "ground_speed_delay", GPS_LATE, 0.1),
        (with_a_growing_radius, {"wheel_radius": f"{RADIUS} m"}, "rolling_radius_growth", GROWTH, 0.05),
        (on_a_flat_track, {}, "slip_lag", -LATE, 0.15),
    ],
)
def test_a_fault_is_named_and_leaves_the_curve(
    sweep: Callable[[int], dict[str, np.ndarray]],
    vehicle: Mapping[str, str],
    effect: str,
    size: float,
    tolerance: float,
    tmp_path: Path,
) -> None:
    units = {"time": "s", "wheel_speed": "rad/s", "vehicle_speed": "m/s", "slip": "1", "force_x": "N", "force_z": "N"}
    for k in range(4):
        table = {"time": TIME, **sweep(k)}
        np.savetxt(
            tmp_path / f"{k}.csv", np.transpose([*table.values()]), "%.5f", ",", header=",".join(table), comments=""
        )
    description = {
        "test": "tire",
        "vehicle": dict(vehicle),
        "channels": {name: {"column": name, "unit": units[name]} for name in table},
        "runs": [{"log": f"{k}.csv"} for k in range(4)],
    }
    (tmp_path / "tire.yaml").write_text(yaml.safe_dump(description), encoding="utf-8")
    document = execute("tire", tmp_path / "tire.yaml").document
    assert document["diagnosis"]["verdict"] == "named"
    (cause,) = document["diagnosis"]["causes"]
    assert cause["effect"] == effect
    assert cause["unknowns"][effect]["value"] == pytest.approx(size, rel=tolerance)
    for name, truth in zip(("tire_B", "tire_C", "tire_D"), CURVE, strict=False):
        assert document["parameters"][name]["value"] == pytest.approx(truth, rel=0.02)


def pulsed(k: int) -> dict[str, np.ndarray]:
    """Braking in pulses, three a second, of a tire that must roll ``RELAXATION`` until its slip acts."""
    rng = np.random.default_rng(k)
    time, speed = np.arange(1500) / 250.0, 9.0 * (1 + k)
    slip = -0.1 * np.clip(time, 0.0, 1.0) * (1.0 - np.cos(2 * np.pi * 3.1 * time)) * (1.0 - 0.5 * np.cos(time))
    acts, kept = np.zeros_like(slip), np.exp(-speed / 250.0 / RELAXATION)
    for i in range(1, time.size):
        acts[i] = kept * acts[i - 1] + (1.0 - kept) * (slip[i - 1] + slip[i]) / 2
    noise = rng.standard_normal((3, time.size)) * np.array([[1e-3], [12.0], [12.0]])
    read = np.array([slip, friction(acts, *CURVE) * LOAD, np.full(time.size, LOAD)]) + noise
    channels = dict(zip(("slip", "force_x", "force_z"), read, strict=True))
    return {"time": time, **channels, "vehicle_speed": np.full(time.size, speed)}


@pytest.mark.slow  # three fits of 2 s
def test_a_diagnosis_starts_from_the_likeliest_effect_where_no_curve_can_be_fitted() -> None:
    logs = [Log(f"{k}.csv", table.pop("time"), table) for k, table in enumerate(map(pulsed, range(2)))]
    problem = prepare(TireSpec.model_validate({"test": "tire"}), logs, Parameters({}))
    effects = [e for e in catalog() if e.name in ("slip_offset", "tire_relaxation")]
    added = AddedEffects(tuple(effects), tuple(u for e in effects for u in unknowns_of(e, prior=True)))
    found = _with_likely_effect(replace(problem.fit, prior=CAR_TIRES, added=added), effects)
    assert found["tire_relaxation"] == pytest.approx(RELAXATION, rel=0.1)
    assert "slip_offset" not in found
