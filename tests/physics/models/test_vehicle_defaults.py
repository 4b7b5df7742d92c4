"""What stands in for parameters that nobody gave."""

from __future__ import annotations

import pytest

from vdyn_cli.physics.models.vehicle_defaults import complete


def test_what_is_known_stands_and_what_follows_from_it_is_said():
    known = {"wheelbase": 2.7, "cg_to_rear": 1.45, "frontal_area": 2.2, "drag_coefficient": 0.25, "air_density": 1.2}
    done = complete(("wheelbase", "cg_to_front", "drag_area", "air_density", "rolling_speed"), known)
    assert done.values == pytest.approx(
        {"wheelbase": 2.7, "cg_to_front": 1.25, "drag_area": 0.55, "air_density": 1.2, "rolling_speed": 0.0}
    )
    assert list(done.assumed) == ["cg_to_front", "drag_area", "rolling_speed"]
    assert done.missing == ()


def test_what_nothing_can_stand_for_is_missing():
    done = complete(("mass", "unsprung_mass_front", "shaft_stiffness_left", "shaft_damping_left"), {})
    assert done.missing == ("mass", "shaft_stiffness_left")


def test_a_default_that_follows_from_what_is_missing_is_not_demanded():
    """The yaw inertia follows from the pitch inertia, which is to be given; a drag area follows from two others."""
    done = complete(("pitch_inertia", "yaw_inertia", "drag_area", "rolling_speed"), {})
    assert done.missing == ("pitch_inertia", "drag_area")


def test_the_driveline_is_what_the_rotating_mass_leaves():
    known = {"rotating_mass": 87.5, "wheel_radius": 0.308, "wheel_inertia": 1.25}
    done = complete(("driveline_inertia",), known)
    assert done.values["driveline_inertia"] == pytest.approx(3.3, abs=0.01)
    bare = complete(("driveline_inertia",), {**known, "rotating_mass": 52.7})
    assert bare.values["driveline_inertia"] > 0
    assert "gears only" in bare.assumed["driveline_inertia"]


def test_one_side_of_the_driveline_tells_of_the_other():
    known = {"shaft_stiffness_left": 30e3, "shaft_stiffness_right": 15e3, "shaft_damping_left": 60.0}
    assert complete(("shaft_damping_right",), known).values["shaft_damping_right"] == pytest.approx(30.0)
