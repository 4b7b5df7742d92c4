"""Front and rear dampers may differ; with a balance of zero the law is plain."""

from __future__ import annotations

import pytest

from vdyn_cli.effects.asymmetric_damping import asymmetric_damping
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.physics.laws.suspension import damper


@pytest.mark.parametrize(("place", "factor"), [("_front", 1.4), ("_fl", 1.4), ("_rear", 0.6), ("_rr", 0.6)])
def test_the_balance_raises_the_front_and_lowers_the_rear(place: str, factor: float) -> None:
    s = Signals(damping=1000.0, stroke_rate=0.5, place=place, share=1.0)
    plain = Signals(damping_asymmetry=0.2, damping_asymmetry_balance=0.0)
    shifted = Signals(damping_asymmetry=0.2, damping_asymmetry_balance=0.4)
    assert float(asymmetric_damping.law(damper, s, plain)) == pytest.approx(600.0)
    assert float(asymmetric_damping.law(damper, s, shifted)) == pytest.approx(500.0 + factor * 100.0)
