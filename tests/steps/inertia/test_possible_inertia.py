"""The stated mass and radius of a wheel limit its inertia in the diagnosis, unless they are not those of the wheel."""

from __future__ import annotations

import pytest

from vdyn_cli.physics.models.wheel_spin import WHEEL_SPIN
from vdyn_cli.steps.inertia.moment_balance import MomentBalance

WHEEL = {"wheel_mass": 20.0, "wheel_radius": 0.3, "rolling_resistance": 0.01}  # m r^2 = 1.8 kg m^2


@pytest.mark.parametrize(("inertia", "possible"), [(1.1, True), (0.9, True), (0.2, False), (2.5, False)])
def test_an_inertia_beyond_that_of_disk_and_hoop_is_impossible(inertia: float, possible: bool):
    found = MomentBalance((), WHEEL, 1.0, WHEEL_SPIN).possible_inertias(inertia)
    assert found == (pytest.approx((0.36, 1.98)) if possible else None)


def test_a_free_wheel_has_no_stated_mass():
    assert MomentBalance((), {}, 1.0, WHEEL_SPIN).possible_inertias(1.1) is None


@pytest.mark.parametrize(("inertia", "doubted"), [(1.1, False), (0.3, True), (2.5, True)])
def test_an_inertia_that_no_wheel_has_is_doubted(inertia: float, doubted: bool):
    found = MomentBalance((), WHEEL, 1.0, WHEEL_SPIN).doubted_inertia(inertia)
    assert bool(found) is doubted
    assert all(f.doubt and "0.36 to 2 kg m^2 are possible" in f.what for f in found)
