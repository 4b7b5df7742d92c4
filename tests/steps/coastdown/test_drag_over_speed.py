"""A resistance that increases with speed, and a drag area that changes with it, give the same road load."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.steps.coastdown.doubts.drag_over_speed import drag_over_speed
from vdyn_cli.steps.coastdown.fit.reference_conditions import RoadLoad

MASS, DENSITY, SPEEDS = 1500.0, 1.2, (5.0, 31.0)


def load(f0: float, f1: float, f2: float, std: float) -> RoadLoad:
    """A road load that is known to std (N) at every speed."""
    return RoadLoad(f0, f1, f2, np.diag([std**2, 0.0, 0.0]), 20.0)


def test_a_car_that_sinks_with_speed_has_its_drag_areas_in_the_interval() -> None:
    """Cd A falls from 0.56 by 12 % at 30 m/s; the three coefficients are those that fit its force best."""
    speed = np.linspace(*SPEEDS, 200)
    force = 140.0 + 0.5 * DENSITY * 0.56 * (1.0 - 0.12 * (speed / 30.0) ** 2) * speed**2
    f0, f1, f2 = np.linalg.lstsq(np.vander(speed, 3, increasing=True), force, rcond=None)[0].tolist()
    area = f2 / (0.5 * DENSITY)
    assert area < 0.45
    found = drag_over_speed(load(f0, f1, f2, 4.0), SPEEDS, MASS, DENSITY)
    assert found is not None
    assert found.matters(area, 0.05)
    slow, fast, steeper = found.areas
    assert slow == pytest.approx(0.56, rel=0.03)
    assert fast == pytest.approx(0.56 * (1.0 - 0.12 * (31.0 / 30.0) ** 2), rel=0.03)
    low, high = found.widened("drag_area", area, (area - 0.05, area + 0.05))
    assert low == pytest.approx(steeper - 0.05)
    assert high > 0.56
    assert "m^2 at 18 km/h" in found.finding().what
    assert ",," not in found.finding().what


def test_a_rolling_resistance_that_grows_faster_than_in_proportion_has_its_drag_area_in_the_interval() -> None:
    """A truck of 30 t whose rolling resistance grows by half up to 24 m/s, with V^1.5."""
    speed = np.linspace(4.0, 24.0, 200)
    force = 30e3 * 9.80665 * 0.0055 * (1.0 + 0.5 * (speed / 24.0) ** 1.5) + 0.5 * DENSITY * 5.7 * speed**2
    f0, f1, f2 = np.linalg.lstsq(np.vander(speed, 3, increasing=True), force, rcond=None)[0].tolist()
    area = f2 / (0.5 * DENSITY)
    assert area > 6.5
    found = drag_over_speed(load(f0, f1, f2, 50.0), (4.0, 24.0), 30e3, DENSITY)
    assert found is not None
    assert min(found.areas) == pytest.approx(5.7, rel=0.03)
    assert found.widened("drag_area", area, (area - 0.1, area + 0.1))[0] < 5.7
    assert "V^1.5" in found.finding().what


def test_a_force_that_no_drag_area_describes_or_that_is_constant_is_not_reported() -> None:
    assert drag_over_speed(load(140.0, 6.0, 0.2, 0.5), SPEEDS, MASS, DENSITY) is None
    found = drag_over_speed(load(180.0, 0.0, 0.34, 4.0), SPEEDS, MASS, DENSITY)
    assert found is not None
    assert not found.matters(0.34 / (0.5 * DENSITY), 0.05)
