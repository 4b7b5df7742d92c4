"""Exported C and the simulation of the same model give the same values, bit for bit."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest

from tests.engine.c_host import Compiled
from tests.engine.effects import FADING
from tests.engine.plants import HALF, HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.effects import catalog
from vdyn_cli.engine import maths
from vdyn_cli.engine.c_source import c_program
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import ModelBuilder, Signals
from vdyn_cli.engine.simulate import Drive, Simulator

HEADWIND = next(effect for effect in catalog() if effect.name == "headwind")
CLOCK = np.cumsum(np.full(400, 0.01) + np.random.default_rng(3).uniform(-0.002, 0.002, 400))


def simulated(
    folder: Path, model: Model, parameters: dict, inputs: dict, effects: tuple = (), substeps: int = 1, **rest
):
    """The C program, and what it and Python simulate."""
    start, context = rest.get("start", {}), rest.get("context", {})
    program = c_program(trace(model, effects), substeps, "car", start=tuple(start), defaults=parameters)
    compiled = Compiled(program, folder)
    drive = Drive(CLOCK, inputs, start, context=context)
    expected = Simulator(model, parameters, (), effects, substeps)(drive, sensitivities=False).outputs
    got = compiled.simulate(CLOCK, inputs, {**compiled.defaults(), **context}, tuple(start.values()))
    return program, got, expected


def equal(got, expected):
    """Whether both have the same outputs, to the last bit."""
    return list(got) == list(expected) and all(np.array_equal(got[n], v) for n, v in expected.items())


@pytest.mark.parametrize("substeps", [1, 3])
def test_road_load_with_an_effect_has_the_same_bits(tmp_path, substeps):
    inputs = {"drive_force": 900 * np.sin(CLOCK), "wind": 0.3, "grade": 0.01 * np.cos(CLOCK)}
    parameters = {**ROAD, "headwind": 1.7}
    program, *both = simulated(
        tmp_path, ROAD_LOAD, parameters, inputs, (HEADWIND,), substeps, start={"speed": 22.5}, context={"heading": -1.0}
    )
    assert equal(*both)
    assert "malloc" not in program.source
    assert program.parameters[-2:] == ("headwind", "heading")


def test_half_car_that_lifts_off_has_the_same_bits(tmp_path):
    _, *both = simulated(tmp_path, HALF_CAR, HALF, {"speed": 25 / 3.6}, substeps=20)
    assert equal(*both)


def test_an_effect_with_a_state_of_its_own(tmp_path):
    inputs = {"drive_force": 0.0, "wind": 0.0, "grade": 0.0}
    unknowns = {name: 0.01 for name in FADING.unknowns if name not in FADING.nominal}
    _, *both = simulated(tmp_path, ROAD_LOAD, {**ROAD, **unknowns}, inputs, (FADING,), context={"heading": 1.0})
    assert equal(*both)


def _everything(e: ModelBuilder, u: Signals) -> None:
    x, p = e.state("x", 0.3), e.p
    a, b = x * p.scale, u.push - 0.2
    shapes = [maths.sin(a), maths.cos(a), maths.tan(a), maths.atan(a), maths.tanh(a), maths.exp(a), maths.fabs(b)]
    shapes += [maths.asin(maths.tanh(a)), maths.acos(maths.tanh(a)), maths.log(1 + a * a), maths.sqrt(1 + b * b)]
    shapes += [maths.atan2(a, b), maths.fmax(a, b), maths.fmin(a, b), maths.copysign(a, b), maths.sign(b)]
    shapes += [maths.floor(5 * a), (1 + a * a) ** p.scale, (1 + b * b) ** 2.5, maths.soft_abs(b, 0.1)]
    shapes += [
        maths.where(maths.both(a > 0, b < 0), a, -b),
        maths.where(maths.either(a <= 0, b >= 0.1), a, 1 / (2 + b)),
    ]
    shapes += [maths.where(maths.negate(a > b), 1.0, 2.0), maths.where(a == b, a, 0.0)]
    for i, shape in enumerate(shapes):
        e.sensor(f"shape.{i}", shape)
    e.integrate(x=maths.sin(sum(shapes)) - x)


def test_every_function_that_laws_may_use(tmp_path):
    model = Model("everything", _everything, ("scale",), ("push",))
    program = c_program(trace(model), name="car", defaults={"scale": 1.3})
    compiled = Compiled(program, tmp_path)
    push = np.sin(7 * CLOCK)
    got = compiled.simulate(CLOCK, {"push": push}, compiled.defaults())
    expected = Simulator(model, {"scale": 1.3})(Drive(CLOCK, {"push": push}), sensitivities=False).outputs
    for name, values in expected.items():
        np.testing.assert_array_equal(got[name.replace(".", "_")], values, err_msg=name)


def test_a_model_without_inputs_and_parameters_compiles(tmp_path):
    def swing(e: ModelBuilder, u: Signals) -> None:
        angle, rate = e.state("angle", 0.1), e.state("rate")
        e.integrate(angle=rate, rate=-maths.sin(angle))
        e.sensor("angle", angle)

    _, *both = simulated(tmp_path, Model("swing", swing, (), ()), {}, {}, substeps=2)
    assert equal(*both)


def test_the_header_says_units_and_the_source_needs_no_library_but_libm():
    program = c_program(trace(ROAD_LOAD), 2, "car", start=("speed",), comments={"mass": "kg, vehicle mass"})
    assert "double mass; /* kg, vehicle mass */" in program.header
    assert re.findall(r"#include.*", program.text) == ["#include <math.h>"]
    assert "void car_init(car_state *x, const car_input *u, const car_parameters *p, double speed);" in program.header


def test_what_can_not_be_printed_is_refused():
    static = Model("static", lambda e, u: e.sensor("y", u.x), (), ("x",))
    with pytest.raises(ValueError, match="without states"):
        c_program(trace(static))
    with pytest.raises(ValueError, match="did you mean 'speed'"):
        c_program(trace(ROAD_LOAD), start=("sped",))
    with pytest.raises(ValueError, match="cannot be a name in C"):
        c_program(trace(ROAD_LOAD), name="car", start=("speed",)) and c_program(trace(_keyword()), name="car")


def _keyword() -> Model:
    def assemble(e: ModelBuilder, u: Signals) -> None:
        e.integrate(x=u.double - e.state("x"))

    return Model("keyword", assemble, (), ("double",))
