"""The tire's forces and slips at speed, at rest and in a spin."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.physics.laws.tire_forces import cornering, friction, tire
from vdyn_cli.physics.laws.tire_slip import damped_slip, fresh_tread, slip_rate

CURVE = Signals(load=4000.0, tire_B=12.0, tire_C=1.6, tire_D=1.0, tire_E=0.3, static_load=4000.0)
STILL = Signals(speed=0.0, sliding=0.0, sideways=0.0, slip=0.0, lateral_slip=0.0)
SIGMA = 0.25


def rate(sliding: float, slip: float, fresh: float) -> float:
    return float(slip_rate(Signals(sliding=sliding, slip=slip, fresh=fresh, relaxation_length=SIGMA)))


def test_force_starts_with_b_c_d_and_falls_off_beyond_its_peak() -> None:
    small = 1e-6
    assert float(tire(CURVE.but(slip=small))) / small == pytest.approx(4000 * 12 * 1.6, rel=1e-6)
    curve = np.array([float(tire(CURVE.but(slip=s))) for s in np.linspace(0, 1, 201)])
    assert curve.max() == pytest.approx(4000.0, rel=1e-3)
    assert curve[-1] < 0.95 * curve.max()


def test_friction_falls_with_the_load_and_not_below_nothing() -> None:
    s = CURVE.but(tire_load_sensitivity=5e-5)
    assert float(friction(s)) == 1.0
    assert float(friction(s.but(load=6000.0))) == pytest.approx(0.9)
    assert float(friction(s.but(load=1e5))) == 0.0


def test_lateral_force_starts_linear_and_ends_at_the_friction() -> None:
    s = CURVE.but(tire_cornering_stiffness=18.0, tire_D=0.9)
    assert float(cornering(s.but(slip=1e-5))) == pytest.approx(4000 * 18e-5, rel=1e-6)
    assert float(cornering(s.but(slip=-5.0))) == pytest.approx(-4000 * 0.9, rel=1e-3)


def test_rolling_the_slip_settles_at_sliding_over_speed_within_a_relaxation_length() -> None:
    fresh = float(fresh_tread(STILL.but(speed=20.0, sliding=1.0, slip=0.05)))
    assert fresh == pytest.approx(20.0, rel=1e-5)
    assert rate(1.0, 0.05, fresh) == pytest.approx(0.0, abs=1e-3)
    assert rate(1.0, 0.0, fresh) == pytest.approx(1.0 / SIGMA, rel=5e-3)


def test_at_rest_the_tread_holds() -> None:
    fresh = float(fresh_tread(STILL.but(slip=0.3, lateral_slip=0.1)))
    assert fresh == 0.0
    assert rate(0.0, 0.3, fresh) == 0.0
    assert rate(1e-3, 0.3, fresh) == pytest.approx(1e-3 / SIGMA)


def test_a_spin_on_the_spot_winds_the_tread_up_only_so_far() -> None:
    wound = 16 ** (1 / 5)
    fresh = float(fresh_tread(STILL.but(sliding=10.0, slip=wound)))
    assert rate(10.0, wound, fresh) == pytest.approx(0.0, abs=1e-2)


def test_near_rest_the_tread_damps() -> None:
    s = Signals(slip=0.1, sliding=0.5, speed=0.0, stiffness=12.0, tire_rest_damping=0.3)
    assert float(damped_slip(s)) == pytest.approx(0.1 + 0.5 * 0.3 / 12)
    assert float(damped_slip(s.but(speed=10.0))) == pytest.approx(0.1, abs=1e-5)
