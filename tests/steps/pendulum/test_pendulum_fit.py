"""The fit of a free swing: periods from recordings with friction, disturbances and noise, and inertia from them."""

from __future__ import annotations

import math

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from tests.physics.models.test_pendulum import KINDS, G, inertia_from
from tests.plant import pendulum as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.engine.simulate import Drive
from vdyn_cli.physics.models import pendulum
from vdyn_cli.quantities.errors import InputError, ResultError
from vdyn_cli.quantities.log import Log
from vdyn_cli.quantities.quantity import Given
from vdyn_cli.steps.pendulum.pendulum_fit import Recording, free_swing
from vdyn_cli.steps.pendulum.pendulum_inertia import MeasuredPeriod, inertia_budget, rod_stiffness

Array = NDArray[np.float64]
NOISE = math.radians(0.05)


def geometry(hung: plant.Rig) -> dict[str, float]:
    return {"half_spacing": hung.distance, "cord_length": hung.cord, "gravity": G} if hung.kind == "bifilar" else {}


def recording(kind: str, seed: int = 1, duration: float = 20.0) -> tuple[Recording, plant.Rig, float]:
    vehicle = random_vehicle(seed)
    hung, (log,) = plant.rig(vehicle, kind), plant.campaign(vehicle, seed, kind=kind, duration=duration)
    time, rate = log["Time [s]"], log["Angular Rate [rad/s]"]
    return Recording("gyro.csv", "angular_rate", time, rate, kind, geometry(hung)), hung, vehicle.wheel_inertia


def test_a_bar_calibrates_the_rod_it_hangs_on() -> None:
    stiffness = rod_stiffness(bar_mass=4.0, bar_length=0.8, bar_diameter=0.03, bar_period=0.9)
    bar = pendulum.bar_inertia(4.0, 0.8, 0.03)
    assert bar == pytest.approx(4.0 * (3 * 0.015**2 + 0.8**2) / 12)
    assert pendulum.torsional_inertia(0.9, stiffness) == pytest.approx(bar)


@pytest.mark.parametrize("kind", KINDS)
def test_the_model_swings_as_energy_demands(kind: str) -> None:
    hung, inertia = plant.rig(random_vehicle(4), kind), 1.1
    at_pivot = inertia + (hung.mass * hung.distance**2 if kind == "compound" else 0.0)
    period = plant.period(hung, inertia, 1e-3)
    swung = plant.Swing(np.linspace(0.0, 8.0, 4001), 0.3, -0.4)
    simulator = Recording("", "angular_rate", swung.times, swung.times, kind, geometry(hung)).simulator(period, (), ())
    drive = Drive(swung.times, {}, {"angle": 0.3, "angular_rate": -0.4}, {"damping": hung.friction / at_pivot / 2})
    assert simulator(drive).outputs["angular_rate"] == pytest.approx(plant.noise_free(hung, inertia, swung), abs=2e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_the_period_of_a_noisy_recording_gives_the_inertia(kind: str) -> None:
    gyro, hung, inertia = recording(kind)
    swing = free_swing(gyro)
    period, std = swing.solution.values["period"], swing.solution.std["period"]
    slope = (inertia_from(hung, period + std) - inertia_from(hung, period - std)) / 2
    assert abs(inertia_from(hung, period) - inertia) < 4 * slope
    assert slope < 3e-4 * inertia
    assert swing.disturbances == ()


def test_a_recording_of_the_angle_serves_as_well() -> None:
    hung, inertia, rng = plant.rig(random_vehicle(6)), 1.2, np.random.default_rng(6)
    swung = plant.Swing(np.arange(8000) / 500, 0.2, 0.0)
    rate = plant.noise_free(hung, inertia, swung)
    angle = 0.2 + np.concatenate([[0.0], np.cumsum((rate[1:] + rate[:-1]) / 1000)])
    noisy = angle + 0.03 + math.radians(0.02) * rng.standard_normal(angle.size)
    swing = free_swing(Recording("angle.csv", "angle", swung.times, noisy, "compound"))
    assert inertia_from(hung, swing.solution.values["period"]) == pytest.approx(inertia, rel=2e-4)
    assert swing.solution.values["angle_zero"] == pytest.approx(0.03, abs=1e-3)


def test_a_disturbance_is_noticed_and_does_not_shift_the_period() -> None:
    # as if it slipped by 4 ms of its swing
    hung, inertia, rng = plant.rig(random_vehicle(5)), 1.2, np.random.default_rng(5)
    swung = plant.Swing(np.arange(4000) / 500, 0.2, 0.0)
    clean = plant.noise_free(hung, inertia, swung)
    late = plant.noise_free(hung, inertia, plant.Swing(swung.times + 0.004, 0.2, 0.0))
    disturbed = np.where(swung.times < 4.3, clean, late) + NOISE * rng.standard_normal(swung.times.size)
    swing = free_swing(Recording("gyro.csv", "angular_rate", swung.times, disturbed, "compound"))
    assert swing.disturbances == pytest.approx((4.3,), abs=0.15)
    assert inertia_from(hung, swing.solution.values["period"]) == pytest.approx(inertia, rel=5e-4)


@pytest.mark.parametrize(("dry", "viscous", "air"), [(0.02, 0.0, 0.0), (0.0, 0.005, 0.05), (0.06, 0.01, 0.0)])
def test_any_friction_leaves_the_period_alone(dry: float, viscous: float, air: float) -> None:
    def law(_: float, y: Array) -> tuple[float, float]:
        return y[1], -19.2 * math.sin(y[0]) - dry * math.tanh(y[1] / 0.003) - (2 * viscous + air * abs(y[1])) * y[1]

    time = np.arange(0.0, 20.0, 0.004)
    clean = solve_ivp(law, (0.0, 20.0), [0.25, 0.0], t_eval=time, rtol=1e-8, atol=1e-10, method="LSODA").y[1]
    noisy = clean + NOISE * np.random.default_rng(1).standard_normal(time.size)
    swing = free_swing(Recording("gyro.csv", "angular_rate", time, noisy, "compound"))
    assert swing.solution.values["period"] == pytest.approx(2 * math.pi / math.sqrt(19.2), rel=3e-5)
    assert swing.disturbances == ()


def test_a_log_without_angle_and_rate_is_refused() -> None:
    with pytest.raises(InputError, match="has neither angular_rate nor angle"):
        Recording.of(Log("gyro.csv", np.arange(100) / 500, {"speed": np.zeros(100)}), "compound", {})


def test_what_is_no_swing_is_refused() -> None:
    time = np.arange(3000) / 500
    noise = np.random.default_rng(2).standard_normal(time.size)
    with pytest.raises(ResultError, match="free swing"):
        free_swing(Recording("gyro.csv", "angular_rate", time, noise, "compound"))
    with pytest.raises(ResultError, match="30 samples: "):
        free_swing(Recording("gyro.csv", "angular_rate", time[:30], noise[:30], "compound"))
    with pytest.raises(ResultError, match="swings of"):
        free_swing(Recording("gyro.csv", "angular_rate", time[:900], np.sin(5.0 * time[:900]), "compound"))
    with pytest.raises(ResultError, match="too large"):
        free_swing(Recording("gyro.csv", "angular_rate", time, 573 * np.sin(5.0 * time), "torsional"))


def test_a_period_that_leaves_no_inertia_is_refused() -> None:
    hung = {"mass": Given(20.0), "pivot_distance": Given(0.3), "gravity": Given(G)}
    with pytest.raises(ResultError, match=r"the period is below 1\.099 s"):
        inertia_budget("compound", hung, MeasuredPeriod(Given(1.05)))
