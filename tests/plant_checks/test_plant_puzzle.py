"""The worked example: its logs are small, and they tell the motors' inertia from whatever looks like it."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import drive, drive_information, puzzle
from tests.plant.drive_motion import Drive
from tests.plant.hidden import Evidence
from tests.plant.information import prior, total
from tests.plant.sensors import regular
from tests.plant.vehicle import REFERENCE

pytestmark = pytest.mark.slow  # checks the plant, not the program


@pytest.fixture(scope="module")
def evidence() -> Evidence:
    """Of two of the four launches, the parameters that matter most being uncertain."""
    sizes = {**puzzle.truth(), **puzzle.RIVALS}
    names = ("mass", "rolling_resistance", "drag_area", "wheel_inertia", "tire_B")
    spread = {name: drive_information.SPREAD[name] for name in names}
    plans = puzzle.pedals(levels=puzzle.LEVELS[2:])
    seen = [header for header in drive_information.SEEN if header not in puzzle.LEFT_OUT]
    info = drive_information.information(REFERENCE, 1, tuple(sizes), spread, plans, puzzle.RIG, seen)
    loose = prior({name: 10.0 * size for name, size in sizes.items()})
    return Evidence(sizes, ("motor_inertia",), info.known(list(puzzle.RIVALS)), total([info, loose]))


@pytest.mark.thorough
def test_the_inertia_is_distinguished_from_every_rival(evidence: Evidence) -> None:
    assert evidence.t()["motor_inertia"] > 20
    assert all(t > 20 for t in evidence.rivals()["motor_inertia"].values())


def test_without_the_motors_the_car_would_be_faster() -> None:
    (plan,) = puzzle.pedals(levels=(1.9,))
    end = plan.knots[-1]
    with_motors, without = (
        Drive(car, plan).travel(regular(end, 10.0)).speed[-1]
        for car in (REFERENCE, REFERENCE.but(driveline_inertia=puzzle.KNOWN[0]))
    )
    assert 1.01 < without / with_motors < 1.04


def test_launches_reach_90_at_different_levels_and_nobody_brakes() -> None:
    plans = puzzle.pedals()
    assert all(max(plan.brake) == 0 for plan in plans)
    accelerations = [max(plan.drive) for plan in plans]
    assert np.all(np.diff(accelerations) > 20)
    assert [run.direction for run in puzzle.campaign()] == ["out", "back", "out", "back"]


def test_the_logs_are_small_and_hold_no_brake() -> None:
    samples = puzzle.samples()
    assert sum(len(content) for content in samples.files.values()) < 1.5e6
    assert samples.truth["motor_inertia"] == pytest.approx(3.2)
    head = samples.files["puzzle_1.csv"].splitlines()[0].decode()
    assert "Shaft Torque Left" in head
    assert not any(header in head for header in puzzle.LEFT_OUT)
    assert set(drive.truth(REFERENCE)) < set(samples.truth)
