"""Free profiles: any shape over one signal, nothing at zero, and finite everywhere."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from vdyn_cli.effects import Effect
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.steps.free_profiles import KNOTS, profile, span_of

FORCE = profile("force_over_speed", "driveline", "speed", (5.0, 33.0), 100.0, "N")
AT = np.linspace(5.0, 33.0, KNOTS)


def drag(s: Signals) -> float:
    return 17.25 * float(s.speed)


def law(made: Effect, speed: float, values: list[float], **signals: float) -> float:
    return float(
        made.law(drag, Signals(speed=speed, **signals), Signals(**dict(zip(made.unknowns, values, strict=True))))
    )


def test_unknowns_say_where_their_knots_are() -> None:
    assert list(FORCE.unknowns) == [f"force_over_speed_{k}" for k in range(1, KNOTS + 1)]
    assert FORCE.on == ("driveline",)
    for quantity, knot in zip(FORCE.unknowns.values(), AT, strict=True):
        assert f"{knot:.3g}" in quantity.meaning
        assert (quantity.unit, quantity.lower, quantity.upper) == ("N", -100.0, 100.0)


@given(st.floats(-100, 100))
def test_nothing_at_zero_to_the_bit(speed: float) -> None:
    assert law(FORCE, speed, [0.0] * KNOTS) == drag(Signals(speed=speed))


@given(st.floats(-20, 60), st.lists(st.floats(-100, 100), min_size=KNOTS, max_size=KNOTS))
def test_straight_between_knots_and_constant_beyond_them(speed: float, values: list[float]) -> None:
    added = law(FORCE, speed, values) - drag(Signals(speed=speed))
    assert added == pytest.approx(np.interp(speed, AT, values), abs=1e-9)


def test_knots_can_be_given() -> None:
    few = profile("few", "driveline", "speed", [5.0, 19.0, 33.0], 100.0, "N")
    assert list(few.unknowns) == ["few_1", "few_2", "few_3"]
    assert law(few, 12.0, [0.0, 8.0, 0.0]) - drag(Signals(speed=12.0)) == pytest.approx(4.0)


def test_a_sensor_that_sees_its_share_gets_it() -> None:
    ones = [1.0] * KNOTS
    assert law(FORCE, 20.0, ones, share=0.25) - drag(Signals(speed=20.0)) == pytest.approx(0.25)


def test_the_span_leaves_outliers_out() -> None:
    speed = np.concatenate([np.linspace(10.0, 20.0, 1001), [900.0], [np.nan]])
    low, high = span_of([speed[:500], speed[500:]], 0.0)
    assert low == pytest.approx(10.1, abs=0.01)
    assert high == pytest.approx(19.9, abs=0.02)


@pytest.mark.parametrize("least", [0.0, 1.0])
def test_a_constant_signal_still_has_a_span(least: float) -> None:
    low, high = span_of([np.full(50, 7.0)], least)
    assert low == 7.0
    assert high - low == pytest.approx(max(least, 1e-6))
    flat = profile("flat", "driveline", "speed", (low, high), 1.0, "N")
    assert np.isfinite(law(flat, 7.0, [1.0] * KNOTS))
