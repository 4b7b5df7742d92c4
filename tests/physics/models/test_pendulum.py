"""Pendulums: closed forms, and wide swings corrected to small ones."""

from __future__ import annotations

import math

import pytest

from tests.plant import pendulum as plant
from tests.plant.vehicle import random_vehicle
from vdyn_cli.physics.models import pendulum

G = plant.GRAVITY
KINDS = ("compound", "bifilar", "torsional")


def inertia_from(hung: plant.Rig, period: float) -> float:
    if hung.kind == "compound":
        return pendulum.compound_inertia(period, hung.mass, hung.distance, G)
    if hung.kind == "bifilar":
        return pendulum.bifilar_inertia(period, hung.mass, 2 * hung.distance, hung.cord, G)
    return pendulum.torsional_inertia(period, hung.stiffness)


def test_a_rod_swung_about_its_end() -> None:
    period = 2 * math.pi * math.sqrt(2 * 1.2 / (3 * G))
    assert pendulum.compound_inertia(period, 3.0, 0.6, G) == pytest.approx(3.0 * 1.2**2 / 12)


def test_a_rod_on_two_cords_at_its_ends() -> None:
    # J = m s^2 / 12 swings with T = 2 pi sqrt(l / (3 g)), whatever its mass
    period = 2 * math.pi * math.sqrt(0.9 / (3 * G))
    assert pendulum.bifilar_inertia(period, 2.0, 0.5, 0.9, G) == pytest.approx(2.0 * 0.5**2 / 12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("amplitude", [0.1, 0.35])
def test_wide_swings_are_corrected_to_small_ones(kind: str, amplitude: float) -> None:
    hung, inertia = plant.rig(random_vehicle(3), kind), 1.3
    wide = plant.period(hung, inertia, amplitude)
    small = pendulum.small_swing(kind, wide, amplitude, 2 * hung.distance, hung.cord, G)
    assert inertia_from(hung, small) == pytest.approx(inertia, rel=3e-5)
    if kind != "torsional":
        assert inertia_from(hung, wide) > inertia * (1 + amplitude**2 / 10)
