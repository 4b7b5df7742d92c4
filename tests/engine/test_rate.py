"""Readings that are the time derivative of an expression."""

from __future__ import annotations

import numpy as np

from tests.engine.effects import speed_scale
from vdyn_cli.effects import catalog
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.maths import cos
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Signals
from vdyn_cli.engine.simulate import Drive, Simulator


def assemble(e: ModelBuilder, u: Signals) -> None:
    x, v = e.state("x", 1.0), e.state("v", 0.0)
    e.rate("speed", of=x)  # asked for before the rates are known
    e.rate("push", of=-(e.p.stiffness) * x + u.force)
    e.rate("turn", of=cos(x) * v)
    e.integrate(x=v, v=-e.p.stiffness * x + u.force)
    e.sensor("place", x)


SWING = Model("swing", assemble, ("stiffness",), ("force",))
TIME = np.linspace(0.0, 2.0, 2001)


def test_rates_are_derivatives_along_the_states() -> None:
    found = Simulator(SWING, {"stiffness": 9.0}, ("stiffness",))(Drive(TIME, {"force": 0.0}), [9.0])
    assert tuple(found.outputs) == ("place", "speed", "push", "turn")
    np.testing.assert_allclose(found.outputs["speed"], -3 * np.sin(3 * TIME), atol=1e-9)
    np.testing.assert_allclose(found.outputs["push"], 27 * np.sin(3 * TIME), atol=1e-8)
    x, v = np.cos(3 * TIME), -3 * np.sin(3 * TIME)
    np.testing.assert_allclose(found.outputs["turn"], -np.sin(x) * v**2 - 9 * x * np.cos(x), atol=1e-8)
    slope = (-np.sin(3 * TIME) - 3 * TIME * np.cos(3 * TIME)) / 6  # of -w sin(w t) to w^2
    np.testing.assert_allclose(found.sensitivities["speed"][:, 0], slope, atol=1e-8)


def test_inputs_are_held() -> None:
    found = Simulator(SWING, {"stiffness": 0.0})(Drive(TIME, {"force": TIME}))
    assert not found.outputs["push"].any()


def test_effects_correct_them_as_any_sensor() -> None:
    assert [e.name for e in applicable(SWING, (speed_scale, *catalog()))][:1] == ["speed_scale"]
    plain, scaled = (
        Simulator(SWING, {"stiffness": 9.0, **gain}, (), (speed_scale,))(Drive(TIME, {"force": 0.0}))
        for gain in ({}, {"speed_gain": 0.5})
    )
    np.testing.assert_allclose(scaled.outputs["speed"], 1.5 * plain.outputs["speed"], rtol=1e-14)
