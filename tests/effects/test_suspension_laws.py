"""Front and rear struts may differ, and friction may turn over a rate; with shapes at zero the laws are plain."""

from __future__ import annotations

import numpy as np
import pytest

from vdyn_cli.effects.asymmetric_damping import asymmetric_damping
from vdyn_cli.effects.degressive_damping import degressive_damping
from vdyn_cli.effects.progressive_spring import progressive_spring
from vdyn_cli.effects.suspension_friction import bristle, suspension_friction
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.physics.laws.suspension import damper, spring


@pytest.mark.parametrize(("place", "factor"), [("_front", 1.4), ("_fl", 1.4), ("_rear", 0.6), ("_rr", 0.6)])
def test_the_balance_raises_the_front_and_lowers_the_rear(place: str, factor: float) -> None:
    s = Signals(damping=1000.0, stroke_rate=0.5, place=place, share=1.0)
    plain = Signals(damping_asymmetry=0.2, damping_asymmetry_balance=0.0)
    shifted = Signals(damping_asymmetry=0.2, damping_asymmetry_balance=0.4)
    assert float(asymmetric_damping.law(damper, s, plain)) == pytest.approx(600.0)
    assert float(asymmetric_damping.law(damper, s, shifted)) == pytest.approx(500.0 + factor * 100.0)


@pytest.mark.parametrize(("place", "expected"), [("_front", 160.0), ("_rear", 90.0)])
def test_struts_in_front_and_at_the_rear_have_their_own_friction(place: str, expected: float) -> None:
    s = Signals(damping=1000.0, stroke_rate=0.0, place=place, share=1.0, bristle=1.0)
    q = Signals(suspension_friction=125.0, suspension_friction_balance=0.28)
    assert float(suspension_friction.law(damper, s, q)) == pytest.approx(expected)


@pytest.mark.parametrize(("place", "expected"), [("_front", -2000.0), ("_rear", -3200.0)])
def test_springs_may_stiffen_at_the_rear_alone(place: str, expected: float) -> None:
    """40 kN/m compressed by 50 mm; the rear rate has doubled at 1 / (2 * 12) m."""
    q = Signals(progressive_spring=6.0, progressive_spring_balance=-1.0)
    s = Signals(stiffness=4e4, stroke=-0.05, place=place, share=1.0)
    assert float(progressive_spring.law(spring, s, q)) == pytest.approx(expected)


@pytest.mark.parametrize("rate", [1.0, -1.0])
@pytest.mark.parametrize("exponent", [0.5, 0.0, -1.0])
def test_force_follows_a_power_of_the_rate_in_fast_strokes(exponent: float, rate: float) -> None:
    q = Signals(damping_degression=exponent, damping_degression_balance=0.0)
    force = [
        float(degressive_damping.law(damper, Signals(damping=1000.0, stroke_rate=v, place="_front"), q))
        for v in (1e-4 * rate, 200.0 * rate, 400.0 * rate)
    ]
    assert force[0] == pytest.approx(0.1 * rate, rel=1e-3)
    assert force[2] / force[1] == pytest.approx(2.0 ** (1.0 - exponent), rel=1e-3)


def test_two_departures_of_one_damper_leave_its_rebound_over_compression() -> None:
    """Degressive, asymmetric: the ratio of the forces is that of the slopes at every rate."""
    q = Signals(damping_asymmetry=0.3, damping_asymmetry_balance=0.0, damping_degression=0.4)
    q = q.but(damping_degression_balance=0.0)

    def force(rate: float) -> float:
        s = Signals(damping=1000.0, stroke_rate=rate, place="_front", share=1.0)
        return float(degressive_damping.law(lambda inner: asymmetric_damping.law(damper, inner, q), s, q))

    assert force(0.8) / force(-0.8) == pytest.approx(-1.3 / 0.7)


def at_rest(rate: float, turning: float) -> float:
    """The friction's sense after a long time at a stroke rate."""
    z = 0.0
    for _ in range(4000):
        s = Signals(stroke_rate=rate, bristle=z, suspension_friction_rate=turning)
        z += 2e-4 * float(bristle(s))
    return z


@pytest.mark.parametrize("rate", [0.001, 0.0025, 0.005, 0.01, 0.05, -0.005])
def test_friction_that_turns_over_a_rate_is_a_tanh(rate: float) -> None:
    assert at_rest(rate, 0.005) == pytest.approx(np.tanh(rate / 0.005), abs=0.005)


@pytest.mark.parametrize("rate", [0.001, -0.05])
def test_friction_without_a_turning_rate_slips_fully(rate: float) -> None:
    assert at_rest(rate, 0.0) == pytest.approx(np.sign(rate), abs=0.02)
