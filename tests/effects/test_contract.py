"""What every effect of the catalogue must hold to, now and later: a new file is tested by being there."""

from __future__ import annotations

import ast
import inspect
import math
import pkgutil
from functools import cache
from importlib import import_module
from itertools import product
from typing import Literal, get_args, get_origin, get_type_hints

import casadi as ca
import numpy as np
import pytest

import vdyn_cli.physics.models
from tests.engine.plants import HALF_CAR, ROAD_LOAD
from vdyn_cli import steps
from vdyn_cli.commands.explain import explanation
from vdyn_cli.effects import Effect, candidates, catalogue
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.graph import Graph, trace
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.vocabulary import PARAMETERS

# About those of a car, so that roots and quotients of them exist; what is not named is of the order of one.
TYPICAL = {
    "mass": 1500.0,
    "sprung_mass": 1400.0,
    "pitch_inertia": 2200.0,
    "sprung_pitch_inertia": 2000.0,
    "roll_inertia": 600.0,
    "yaw_inertia": 2400.0,
    "wheelbase": 2.7,
    "cg_to_front": 1.25,
    "unsprung_mass_front": 80.0,
    "unsprung_mass_rear": 70.0,
    "suspension_stiffness_front": 4e4,
    "suspension_stiffness_rear": 4e4,
    "suspension_damping_front": 3e3,
    "suspension_damping_rear": 3e3,
    "tire_vertical_stiffness": 4e5,
    "tire_load_sensitivity": 2e-5,
    "shaft_stiffness_left": 2e4,
    "shaft_stiffness_right": 2e4,
    "shaft_damping_left": 50.0,
    "shaft_damping_right": 50.0,
    "gear_ratio": 3.0,
    "wheel_radius": 0.3,
    "temperature": 290.0,
    "road_begin": -20.0,
    "road_end": 20.0,
}
UNEVEN = 0.3  # share by which typical values differ from moment to moment

EFFECTS = catalogue()
EACH = pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)


def shipped_models() -> list[Model]:
    """Every model of the package, in all variants that its options allow, and the engine's own."""
    found: list[Model] = [ROAD_LOAD, HALF_CAR]
    for module in pkgutil.iter_modules(vdyn_cli.physics.models.__path__):
        for value in vars(import_module(f"vdyn_cli.physics.models.{module.name}")).values():
            if isinstance(value, Model):
                found.append(value)
            elif callable(value) and getattr(value, "__module__", "").startswith("vdyn_cli.physics.models"):
                found += variants(value)
    return [model for model in found if model.name != "vehicle"] + VEHICLES


# Both ways to drive it, and to be somewhere: all twelve variants would take a minute.
VEHICLES = [vehicle(), vehicle("rear", "sides", located=True)]


def variants(function) -> list[Model]:
    """All that a function makes whose arguments are choices; others are covered where they are tested."""
    made = inspect.unwrap(function)
    if getattr(made, "__annotations__", {}).get("return") not in (Model, "Model"):
        return []
    hints = get_type_hints(made)
    del hints["return"]
    literal = {name: get_args(hint) for name, hint in hints.items() if get_origin(hint) is Literal}
    choices = {name: (False, True) if hint is bool else literal.get(name, ()) for name, hint in hints.items()}
    names = [name for name in choices if choices[name]]
    if set(names) != set(inspect.signature(function).parameters):
        return []
    return [function(**dict(zip(names, chosen, strict=True))) for chosen in product(*choices.values())]


MODELS = shipped_models()


def hosts(effect: Effect) -> list[Model]:
    return [model for model in MODELS if applicable(model, (effect,))]


def one_of_each(models: list[Model]) -> list[Model]:
    """One variant of each model: what follows takes long, and variants call the same laws."""
    return list({model.name: model for model in models}.values())


def constants(graph: Graph, random: np.random.Generator) -> np.ndarray:
    """Values of all constants, typical of a car where that matters."""
    uneven = random.uniform(1 - UNEVEN, 1 + UNEVEN, len(graph.constants))
    plain = random.uniform(0.2, 2.0, len(graph.constants))
    typical = [TYPICAL.get(name, np.nan) for name in graph.constants]
    return np.where(np.isnan(typical), plain, np.array(typical) * uneven)


def moments(graph: Graph, count: int = 60) -> list[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Random states, inputs and constants: at standstill, in reverse, and forward."""
    random = np.random.default_rng(7)
    found = []
    for k in range(count):
        x = random.normal(size=len(graph.states)) * (0, 1, 10)[k % 3]
        u = random.normal(size=len(graph.inputs)) * (0, 0.1, 1)[k // 3 % 3]
        x = np.where(np.array(graph.states) == "position", random.uniform(-25, 25, x.size), x)
        u = np.where(np.array(graph.inputs) == "position", random.uniform(-25, 25, u.size), u)
        found.append((x, u, constants(graph, random)))
    return found


def with_unknowns(graph: Graph, effect: Effect, p: np.ndarray, size: float) -> np.ndarray:
    changed = p.copy()
    for name, value in graph.defaults.items():  # leads in force among them
        changed[graph.constants.index(name)] = value
    for name in effect.unknowns:
        changed[graph.constants.index(name)] = effect.nominal.get(name, size)
    return changed


@EACH
def test_it_is_found_under_its_own_name(effect):
    module = import_module(f"vdyn_cli.effects.{effect.name}")
    assert getattr(module, effect.name) is effect
    imported = [
        node.module for node in ast.walk(ast.parse(inspect.getsource(module))) if isinstance(node, ast.ImportFrom)
    ]
    others = [name for name in imported if name and name.startswith("vdyn_cli.effects.")]
    assert not others, "effects never import effects"


@EACH
def test_it_says_what_it_is_in_units_ranges_and_a_reference(effect):
    from vdyn_cli.quantities.quantity import to_si

    assert effect.summary.endswith(".")
    assert len(effect.summary) > 20
    assert len(effect.reference) > 10
    assert effect.kind in ("within_run", "between_run")
    assert effect.unknowns
    for name, quantity in effect.unknowns.items():
        assert quantity.name == name
        assert quantity.meaning
        to_si(1.0, quantity.unit, quantity.unit)
        assert math.isfinite(quantity.lower)
        assert math.isfinite(quantity.upper)
        assert quantity.lower <= effect.nominal.get(name, 0.0) <= quantity.upper
        assert quantity.lower < quantity.upper
    assert set(effect.nominal) < set(effect.unknowns), "something must be zero for the effect to be nothing"
    assert all(quantity.allows(size) for size in effect.probes for quantity in [next(iter(effect.unknowns.values()))])
    assert set(effect.steps) <= set(steps.names())


@EACH
def test_it_says_what_it_looks_like_what_else_does_and_what_would_settle_it(effect):
    for text in (effect.signature, effect.confirm):
        assert text.endswith(".")
        assert text[0].isupper()
        assert 25 < len(text) <= 140
    assert effect.label
    assert effect.label[0].islower()
    assert not effect.label.endswith(".")
    assert effect.alike
    assert effect.name not in effect.alike
    names = {name for name in effect.alike if "_" in name}  # other words speak of the test, such as a bump's height
    assert names <= {other.name for other in EFFECTS} | set(PARAMETERS)
    text = explanation(effect.name)
    ends = (next(iter(effect.unknowns)), list(effect.unknowns)[-1])
    for part in (effect.label, effect.signature, effect.confirm, effect.reference, *ends, *effect.alike):
        assert part in text


def test_each_step_looks_for_its_own():
    coastdown, validate = ({one.name for one in candidates(step)} for step in ("coastdown", "validate"))
    assert {"headwind", "temperature_rolling"} <= coastdown
    assert {"headwind", "backlash", "motor_inertia"} <= validate
    assert "backlash" not in coastdown


def test_a_name_of_an_unknown_belongs_to_one_effect():
    names = [name for effect in EFFECTS for name in effect.unknowns]
    assert len(set(names)) == len(names)


def test_the_order_is_that_of_the_names():
    assert [effect.name for effect in EFFECTS] == sorted(effect.name for effect in EFFECTS)


@EACH
def test_some_model_can_take_it(effect):
    assert hosts(effect)


@EACH
def test_it_is_exactly_nothing_at_zero(effect):
    for model in hosts(effect):
        base, extended = trace(model), trace(model, (effect,))
        own = [i for i, name in enumerate(extended.states) if name in base.states]
        inputs = [extended.inputs.index(name) for name in base.inputs]
        for x, u, p in moments(extended):
            p = with_unknowns(extended, effect, p, 0.0)
            known = [p[extended.constants.index(name)] for name in base.constants]
            rates, readings = (value.full()[:, 0] for value in extended.field(x, u, p))
            plain_rates, plain_readings = (value.full()[:, 0] for value in base.field(x[own], u[inputs], known))
            assert np.array_equal(rates[own], plain_rates, equal_nan=True)
            assert np.array_equal(readings[: len(base.outputs)], plain_readings[: len(base.outputs)], equal_nan=True)
            shifts = readings[len(extended.outputs) + len(extended.rated) :]
            assert not shifts.any()


@EACH
def test_its_derivatives_are_finite_at_zero_and_not_all_zero(effect):
    for model in one_of_each(hosts(effect)):
        graph = trace(model, (effect,))
        names = (*model.parameters, *effect.unknowns)
        felt = {name: False for name in effect.unknowns if name not in effect.nominal}
        x, u, p = (ca.SX.sym(graph.field.name_in(k), *graph.field.size_in(k)) for k in range(3))
        columns = [graph.constants.index(name) for name in names]
        slopes = ca.Function("slopes", [x, u, p], [ca.jacobian(ca.vertcat(*graph.field(x, u, p)), p)[:, columns]])
        plain = ca.Function("plain", [x, u, p], [ca.vertcat(*graph.field(x, u, p))])
        for moment in moments(graph, max(60, 8 * len(effect.unknowns))):
            at = (*moment[:2], with_unknowns(graph, effect, moment[2], 0.0))
            found = slopes(*at).full()
            if np.all(np.isfinite(plain(*at).full())) and np.all(np.isfinite(found[:, : len(model.parameters)])):
                assert np.all(np.isfinite(found))
                for name in felt:
                    felt[name] |= bool(np.any(found[:, names.index(name)]))
        assert all(felt.values()) or effect.probes or not felt


@EACH
def test_whole_trajectories_are_bit_identical_at_zero(effect):
    """With fixed steps they are: no state of an effect can change the steps of the model's."""
    for model in one_of_each(hosts(effect)):
        drive, parameters, plain = trajectory(model)
        if plain is not None:  # random numbers are no car: the moments above still hold
            found = Simulator(model, parameters, (), (effect,), backend="vm")(drive)
            for name, value in plain.outputs.items():
                assert np.array_equal(found.outputs[name], value)


@cache
def trajectory(model: Model) -> tuple[Drive, dict[str, float], Simulated | None]:
    """What drives a model, its parameters, and how it moves without any effect; None where it can't."""
    graph = trace(model)
    random = np.random.default_rng(11)
    time = np.arange(40) * 0.002
    inputs = {name: random.uniform(0, 0.1, time.size) for name in graph.inputs}
    start = {name: random.uniform(0, 0.1) for name in graph.states}
    drive = Drive(time, inputs, start, {}, {name: 1.0 + k for k, name in enumerate(model.context)})
    values = dict(zip(graph.constants, constants(graph, random), strict=True))
    parameters = {name: values[name] for name in model.parameters}
    try:
        return drive, parameters, Simulator(model, parameters, backend="vm")(drive)
    except ResultError:
        return drive, parameters, None
