"""Heave that follows from pitching, against the plant's body on its springs."""

from __future__ import annotations

import numpy as np
import pytest

from tests.plant import cg as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.steps.cg.pitch_heave import pitch_heave


@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_levers_of_springs_and_dampers_describe_the_heave_of_a_body(seed: int) -> None:
    """Heave in proportion to the pitch acceleration, which the pitch inertia holds, leaves three times as much."""
    vehicle = random_vehicle(seed)
    run = plant.manoeuvres(seed, 1)[0]
    true = run.ride(vehicle)
    heave = true.heave_acceleration
    taken = np.column_stack([true.pitch_acceleration, true.acceleration, np.ones_like(heave)])
    swings = np.column_stack([taken, *pitch_heave(run.times, true.pitch_rate)])
    rigid, sprung = (np.std(heave - a @ np.linalg.lstsq(a, heave, rcond=None)[0]) for a in (taken, swings))
    assert sprung < rigid / 3
