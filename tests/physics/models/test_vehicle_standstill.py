"""The vehicle at rest: it stops, holds without creep or chatter, and rolls away when it is let go."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from tests.physics.models.vehicle_cases import CORNERS, Array, drive, pedals, simulate

Knots = tuple[tuple[float, float, float], ...]


@dataclass(frozen=True)
class Case:
    """A drive to rest: pedals (time, torque, brake), and between which times it is at rest."""

    knots: Knots
    still: tuple[float, float]
    grade: float = 0.0
    speed: float = 0.0


CASES = {
    "stopped and held on a slope": Case(
        ((0, 0, 0), (0.3, 800, 0), (4, 800, 0), (4.3, 0, 0), (5, 0, 0), (5.5, 0, 4000), (42, 0, 4000)), (18, 42), 0.12
    ),
    "on the flat": Case(((0, 0, 0), (60, 0, 0)), (0, 60)),
    "stopped by rolling resistance": Case(((0, 0, 0), (40, 0, 0)), (25, 40), speed=1.0),
    "spun, then braked": Case(
        ((0, 0, 0), (0.1, 1500, 0), (2, 1500, 0), (2.1, 0, 0), (2.2, 0, 0), (2.4, 0, 6000), (30, 0, 6000)), (14, 30)
    ),
    "with locked wheels": Case(((0, 0, 0), (0.2, 0, 20_000), (30, 0, 20_000)), (14, 30), speed=20.0),
}


@pytest.mark.parametrize("step", [1e-3, 5e-4])
@pytest.mark.parametrize("name", CASES)
def test_what_has_stopped_stays(name: str, step: float) -> None:
    case = CASES[name]
    time = np.arange(round(case.knots[-1][0] / step) + 1) * step
    found = simulate(drive(time, {"speed": case.speed}, grade=case.grade, **pedals(time, *case.knots)))
    first, last = case.still
    still = (time >= first) & (time <= last)
    moving = ["speed", "lateral_speed", "yaw_rate", *(f"wheel_speed_{at}" for at in CORNERS)]
    assert max(np.max(np.abs(found.states[n][still])) for n in moving) < 1e-6
    assert np.ptp(found.states["position"][still]) < 1e-6
    late = time > last - 5
    assert max(np.max(np.abs(found.states[n][late])) for n in moving) < 1e-11
    assert np.ptp(found.states["position"][late]) < 1e-10
    assert abs(found.states["yaw"][-1]) < 1e-3


def test_a_spin_s_slip_stays_within_bounds() -> None:
    case = CASES["spun, then braked"]
    time = np.arange(5001) * 1e-3
    slip: Array = simulate(drive(time, **pedals(time, *case.knots))).states["slip_fl"]
    assert 0.5 < slip.max() < 1.8


def test_let_go_on_a_slope_it_rolls_back() -> None:
    time = np.arange(10_001) * 1e-3
    found = simulate(drive(time, grade=0.12, **pedals(time, (0, 0, 4000), (6, 0, 4000), (6.3, 0, 0), (10, 0, 0))))
    assert abs(found.outputs["speed"][5990]) < 1e-4
    rate = np.diff(found.outputs["speed"])[-1] / 1e-3
    assert -9.80665 * 0.12 < rate < -0.9  # weight less rolling resistance, over the mass and all that turns
    assert found.outputs["speed"][-1] < -3.0
    assert found.outputs["acceleration"][5990] == pytest.approx(9.80665 * np.sin(np.arctan(0.12)), rel=1e-3)


def test_light_wheels_on_stiff_tires_hold_under_hard_brakes_too() -> None:
    car = {"tire_B": 25.0, "tire_C": 1.9, "tire_D": 1.2, "wheel_inertia": 0.8, "driveline_inertia": 0.3}
    case = CASES["with locked wheels"]
    time = np.arange(20_001) * 1e-3
    found = simulate(drive(time, {"speed": case.speed}, **pedals(time, *case.knots)), car)
    late = time > 15
    assert max(np.max(np.abs(found.states[n][late])) for n in ("speed", "wheel_speed_fl", "wheel_speed_rr")) < 1e-6
