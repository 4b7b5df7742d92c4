"""The interval of a road load that a learned law is part of."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.quantities.law_definition import CurveDefinition, LawDefinition
from vdyn_cli.steps.coastdown.fit.lasting_force import lasting_force
from vdyn_cli.steps.coastdown.fit.reference_conditions import road_load_of
from vdyn_cli.steps.learned_effect import learned_effect

SIZE, LENGTH, SHIFT = 25.0, 30.0, 2.0
NAMES = ("wave_size", "wave_length", "wave_shift")
STD = {"wave_size": 2.0, "wave_length": 1.0, "wave_shift": 0.5}
CAR = {
    "mass": 900.0,
    "rotating_mass": 30.0,
    "rolling_resistance": 0.014,
    "rolling_speed": 0.0,
    "drag_area": 1.0,
    "air_density": 1.18,
}


def test_a_road_load_is_as_uncertain_as_the_shapes_of_its_learned_law() -> None:
    """F = f0 + f2 V^2 + a sin(2 pi (V - s) / l): var F = sum of (dF/dq std q)^2 over a, l and s."""
    curve = CurveDefinition(
        place="", coordinate="speed", coordinate_unit="m/s", unit="N", factor="", span=(8.0, 45.0), scale=0.0,
        anchored=False, form="periodic", unknowns=NAMES,
    )  # fmt: skip
    law = LawDefinition(element="driveline", label="the learned law", tags=(), curves=(curve,))
    wave = learned_effect("wave", law, {n: (v, 0.0, 90.0) for n, v in zip(NAMES, (SIZE, LENGTH, SHIFT), strict=True)})
    at = CAR | {"wave_size": SIZE, "wave_length": LENGTH, "wave_shift": SHIFT}
    found = lasting_force([wave], at, STD, (10.0, 40.0), 293.15)
    load = road_load_of(at, NAMES, np.diag([STD[n] ** 2 for n in NAMES]), 1e6, found)
    speed = found.beyond[0]
    angle = 2 * np.pi * (speed - SHIFT) / LENGTH
    sine, steep = np.sin(angle), SIZE * np.cos(angle) * 2 * np.pi / LENGTH
    moved = np.array([sine * 2.0, -steep * (speed - SHIFT) / LENGTH * 1.0, -steep * 0.5])
    plain = 0.014 * 900 * 9.80665 + 0.59 * speed**2
    assert load.force(speed) == pytest.approx(plain + SIZE * sine, rel=0.01)
    assert load.half_width(speed) == pytest.approx(1.96 * np.sqrt(np.sum(moved**2, axis=0)), rel=0.1, abs=0.5)
