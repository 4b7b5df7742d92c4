"""The effects that apply to a model."""

from __future__ import annotations

import pytest

from tests.engine.effects import FADING, elsewhere, mass_error, needs_more, speed_delay, speed_scale
from tests.engine.plants import HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.effects import catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import MissingSignalError, ModelBuilder, Signals
from vdyn_cli.engine.simulate import Simulator

OURS = (FADING, speed_scale, speed_delay, mass_error, needs_more, elsewhere)


def names(effects):
    return [effect.name for effect in effects]


def test_an_effect_is_offered_where_its_element_is_called_with_its_signals():
    assert names(applicable(ROAD_LOAD, OURS)) == ["fading_drag", "speed_scale", "speed_delay", "mass_error"]
    assert names(applicable(HALF_CAR, OURS)) == []
    road, half = (set(names(applicable(model, catalog()))) for model in (ROAD_LOAD, HALF_CAR))
    assert {"headwind", "extra_drag_area"} <= road
    assert "asymmetric_damping" in half
    assert not road & {"asymmetric_damping"}
    assert not half & {"headwind", "extra_drag_area"}


@pytest.mark.parametrize("effect", [FADING, speed_scale, speed_delay, mass_error], ids=lambda e: e.name)
def test_what_is_offered_can_be_simulated(effect):
    assert Simulator(ROAD_LOAD, ROAD, tuple(effect.unknowns), (effect,)).outputs == ("speed",)


def test_what_is_not_offered_is_refused_with_its_name():
    with pytest.raises(MissingSignalError, match="turbulence"):
        Simulator(ROAD_LOAD, ROAD, (), (needs_more,))
    with pytest.raises(ValueError, match="no element for the effect elsewhere"):
        Simulator(ROAD_LOAD, ROAD, (), (elsewhere,))


def test_an_element_that_lacks_a_signal_is_a_fault_of_the_model_and_not_of_the_effect():
    def broken(s: Signals):
        return s.nobody_gave_this

    def air(s: Signals):
        return broken(s)

    model = Model("broken", lambda e, u: e(air, speed=1.0), (), ())
    with pytest.raises(MissingSignalError, match="nobody_gave_this"):
        applicable(model, catalog())


def test_two_effects_cannot_share_the_name_of_an_unknown():
    with pytest.raises(ValueError, match=r"'latency' .*taken"):
        Simulator(ROAD_LOAD, ROAD, (), (speed_delay, speed_delay))


def test_laws_run_on_floats():
    states = {"speed": 20.0, "position": 0.0}
    builder = ModelBuilder(lambda name, start: states[name], ROAD, {"mass_share": 0.1}, (mass_error,), {"heading": 1.0})
    ROAD_LOAD.assemble(builder, Signals(drive_force=0.0, wind=0.0, grade=0.0))
    drag = 0.5 * 1.2 * 0.6 * 400 + 1650 * 9.80665 * 0.01
    assert builder.rates["speed"] == pytest.approx(-drag / 1695)
    assert builder.outputs["speed"][0] == 20.0


@pytest.mark.parametrize(
    ("assemble", "message"),
    [
        (lambda e, u: e.state("x"), r"\['x'\]"),
        (lambda e, u: e.integrate(y=1.0), r"\['y'\]"),
    ],
)
def test_a_state_needs_a_rate_and_a_rate_a_state(assemble, message):
    with pytest.raises(ValueError, match=message):
        Simulator(Model("odd", assemble, (), ()), {})
