"""Machine code and CasADi's virtual machine give the same values, bit for bit, for all functions of laws."""

from __future__ import annotations

import builtins
import math
import sys

import numpy as np
import pytest

from tests.engine.effects import FADING
from tests.engine.plants import HALF, HALF_CAR, ROAD, ROAD_LOAD
from vdyn_cli.engine import backend as backends
from vdyn_cli.engine import maths
from vdyn_cli.engine.kernel import Seeds
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Signals
from vdyn_cli.engine.native import MachineCode
from vdyn_cli.engine.simulate import Drive, Simulator
from vdyn_cli.engine.vm import VirtualMachine

ANY = (-2.5, -1.0, -0.3, 0.0, 0.3, 1.0, 2.5)
POSITIVE = (1e-3, 0.5, 1.0, 7.0)
UNIT = (-0.9, -0.2, 0.0, 0.6)
PAIRS = tuple((x, y) for x in ANY for y in ANY)

# name: (function of a and b, its derivatives to a and to b, where)
ONE = {
    "sin": (maths.sin, math.cos, ANY),
    "cos": (maths.cos, lambda x: -math.sin(x), ANY),
    "tan": (maths.tan, lambda x: 1 / math.cos(x) ** 2, ANY),
    "asin": (maths.asin, lambda x: 1 / math.sqrt(1 - x * x), UNIT),
    "acos": (maths.acos, lambda x: -1 / math.sqrt(1 - x * x), UNIT),
    "atan": (maths.atan, lambda x: 1 / (1 + x * x), ANY),
    "tanh": (maths.tanh, lambda x: 1 / math.cosh(x) ** 2, ANY),
    "exp": (maths.exp, math.exp, ANY),
    "log": (maths.log, lambda x: 1 / x, POSITIVE),
    "sqrt": (maths.sqrt, lambda x: 0.5 / math.sqrt(x), POSITIVE),
    "fabs": (maths.fabs, lambda x: np.sign(x), ANY),
    "sign": (maths.sign, lambda x: 0.0, ANY),
    "floor": (maths.floor, lambda x: 0.0, ANY),
    "negative": (lambda x: -x, lambda x: -1.0, ANY),
    "double": (lambda x: x + x, lambda x: 2.0, ANY),
    "square": (lambda x: x * x, lambda x: 2 * x, ANY),
    "inverse": (lambda x: 1 / x, lambda x: -1 / x**2, POSITIVE),
    "cube": (lambda x: x**3, lambda x: 3 * x**2, ANY),
    "power": (lambda x: x**1.7, lambda x: 1.7 * x**0.7, (0.0, *POSITIVE)),
    "exponent": (lambda x: 2.0**x, lambda x: 2.0**x * math.log(2), ANY),
    "soft_abs": (lambda x: maths.soft_abs(x, 0.1), lambda x: x / math.hypot(x, 0.1), ANY),
    "branch": (lambda x: maths.where(x > 0, maths.sqrt(x), x), lambda x: 0.5 / math.sqrt(x) if x > 0 else 1.0, ANY),
    "not": (lambda x: maths.where(maths.negate(x > 0.5), 2 * x, x), lambda x: 2.0 if x <= 0.5 else 1.0, ANY),
}
TWO = {
    "sum": (lambda x, y: x + y, lambda x, y: (1, 1), PAIRS),
    "difference": (lambda x, y: x - y, lambda x, y: (1, -1), PAIRS),
    "product": (lambda x, y: x * y, lambda x, y: (y, x), PAIRS),
    "ratio": (lambda x, y: x / y, lambda x, y: (1 / y, -x / y**2), [(x, y) for x in ANY for y in POSITIVE]),
    "power": (
        lambda x, y: x**y,
        lambda x, y: (y * x ** (y - 1), x**y * math.log(x)),
        [(x, y) for x in POSITIVE for y in ANY],
    ),
    "atan2": (
        maths.atan2,
        lambda y, x: (x / (x * x + y * y), -y / (x * x + y * y)),
        [pair for pair in PAIRS if pair != (0.0, 0.0)],
    ),
    "fmax": (maths.fmax, lambda x, y: (0.5, 0.5) if x == y else (float(x > y), float(x < y)), PAIRS),
    "fmin": (maths.fmin, lambda x, y: (0.5, 0.5) if x == y else (float(x < y), float(x > y)), PAIRS),
    "copysign": (maths.copysign, lambda x, y: (np.sign(x) * math.copysign(1, y), 0.0), PAIRS),
    "both": (
        lambda x, y: maths.where(maths.both(x > 0, y >= 0), x * y, x - y),
        lambda x, y: (y, x) if x > 0 and y >= 0 else (1, -1),
        PAIRS,
    ),
    "either": (
        lambda x, y: maths.where(maths.either(x < 0, y != 1), x * y, x - y),
        lambda x, y: (y, x) if x < 0 or y != 1 else (1, -1),
        PAIRS,
    ),
    "equal": (
        lambda x, y: maths.where(x == y, 3 * x, y),
        lambda x, y: (3, 0) if x == y else (0, 1),
        PAIRS,
    ),
}


def function_model(function) -> Model:
    def assemble(e, u: Signals) -> None:
        e.sensor("y", function(e.p.a + u.x, e.p.b + u.y))

    return Model("function", assemble, ("a", "b"), ("x", "y"))


def evaluate(function, x, y, backend):
    simulate = Simulator(function_model(function), {"a": 0.0, "b": 0.0}, ("a", "b"), backend=backend)
    found = simulate(Drive(np.arange(float(len(x))), {"x": x, "y": y}), [0.0, 0.0])
    return found.outputs["y"], found.sensitivities["y"]


def of_two(one):
    """A function of one number, its slope and its places as a function of two that ignores the second."""
    function, slope, where = one
    return lambda x, y: function(x), lambda x, y: (slope(x), 0.0), [(x, 0.0) for x in where]


CASES = {**{f"{name} of one": of_two(one) for name, one in ONE.items()}, **TWO}


@pytest.mark.parametrize("name", CASES)
def test_functions_have_the_same_values_and_slopes_in_every_backend(name):
    function, slopes, where = CASES[name]
    x, y = np.array(list(where)).T
    value, slope = evaluate(function, x, y, "llvm")
    same_value, same_slope = evaluate(function, x, y, "vm")
    assert np.array_equal(value, same_value)
    np.testing.assert_allclose(slope, same_slope, rtol=1e-15, atol=1e-300)
    np.testing.assert_allclose(slope, [slopes(*pair) for pair in where], rtol=2e-13, atol=1e-15)
    for i, pair in enumerate(where):  # laws run on floats too
        assert float(function(*pair)) == pytest.approx(value[i], rel=1e-15, abs=1e-300)


def test_a_branch_that_is_not_taken_leaves_no_trace_of_its_infinite_slope():
    for backend in ("llvm", "vm"):
        value, slope = evaluate(lambda x, y: maths.where(x > 0, maths.sqrt(x), 0.0), np.zeros(1), np.zeros(1), backend)
        assert value[0] == 0
        assert not slope.any()


def models():
    grade = 0.01 * np.sin(np.arange(3000) / 50)
    coast = Drive(np.arange(3000) * 0.1, {"drive_force": 250.0, "wind": 1.0, "grade": grade}, {}, {}, {"heading": 1.0})
    bump = Drive(np.arange(1000) * 0.002, {"speed": 7.0})
    yield ROAD_LOAD, ROAD, (FADING,), ("drag_area", "fading", "start.speed"), [0.6, 0.1, 12.0], coast
    yield HALF_CAR, HALF, (), tuple(HALF), list(HALF.values()), bump


@pytest.mark.parametrize(
    ("model", "parameters", "effects", "unknowns", "theta", "drive"), list(models()), ids=lambda v: ""
)
@pytest.mark.parametrize("substeps", [1, 3])
def test_whole_trajectories_are_bit_identical(model, parameters, effects, unknowns, theta, drive, substeps):
    machine, virtual = (
        Simulator(model, parameters, unknowns, effects, substeps, backend) for backend in ("llvm", "vm")
    )
    found, expected = machine(drive, theta, states=True), virtual(drive, theta, states=True)
    for name, value in expected.outputs.items():
        assert np.array_equal(found.outputs[name], value)
        scale = np.max(np.abs(expected.sensitivities[name]), axis=0)
        assert np.all(np.abs(found.sensitivities[name] - expected.sensitivities[name]) <= 1e-11 * scale)
    assert all(np.array_equal(found.states[name], value) for name, value in expected.states.items())


def test_an_unknown_has_the_same_derivatives_beside_few_and_many_others():
    drive = Drive(np.arange(1000) * 0.002, {"speed": 7.0})
    many = Simulator(HALF_CAR, HALF, tuple(HALF), backend="llvm")(drive, list(HALF.values()))
    for name, at in ((n, list(HALF).index(n)) for n in list(HALF)[-3:]):
        alone = Simulator(HALF_CAR, HALF, (name,), backend="llvm")(drive, [HALF[name]])
        for output, slope in alone.sensitivities.items():
            assert slope[:, 0] == pytest.approx(many.sensitivities[output][:, at], rel=1e-10, abs=1e-300)


def test_the_environment_decides_where_the_caller_does_not(monkeypatch):
    def kind(backend):
        graph = Simulator(ROAD_LOAD, ROAD)._graph
        return type(backends.build(graph, Seeds(np.empty((6, 0)), frozenset(), frozenset()), backend))

    monkeypatch.delenv("VDYN_BACKEND", raising=False)
    assert kind("auto") is MachineCode
    monkeypatch.setenv("VDYN_BACKEND", "vm")
    assert kind("auto") is VirtualMachine
    assert kind("llvm") is MachineCode
    monkeypatch.setenv("VDYN_BACKEND", "fortran")
    with pytest.raises(ValueError, match="no backend 'fortran'"):
        kind("auto")


def test_without_llvmlite_the_virtual_machine_steps_in(monkeypatch):
    real = builtins.__import__

    def without(name, *arguments, **keywords):
        if name.startswith("llvmlite"):
            raise ImportError(name)
        return real(name, *arguments, **keywords)

    from vdyn_cli.engine import native

    monkeypatch.setattr(native, "_llvm", native._llvm.__wrapped__)
    native.compiled.cache_clear()
    for name in [name for name in sys.modules if name.startswith("llvmlite")]:
        monkeypatch.delitem(sys.modules, name)
    monkeypatch.setattr(builtins, "__import__", without)
    monkeypatch.delenv("VDYN_BACKEND", raising=False)
    found = Simulator(HALF_CAR, HALF)(Drive([0.0, 0.1], {"speed": 1.0}))
    assert found.outputs["load_front"].shape == (2,)
    with pytest.raises(ImportError):
        Simulator(HALF_CAR, HALF, backend="llvm")(Drive([0.0, 0.1], {"speed": 1.0}))


def test_the_same_graph_is_compiled_once():
    from vdyn_cli.engine import native

    drive = Drive([0.0, 0.1], {"speed": 1.0})
    Simulator(HALF_CAR, HALF, backend="llvm")(drive)
    before = native.compiled.cache_info().misses
    Simulator(HALF_CAR, {**HALF, "damping_front": 1.0}, backend="llvm")(drive)
    assert native.compiled.cache_info().misses == before
