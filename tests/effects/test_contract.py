"""What every effect of the catalog must hold to, now and later: a new file is tested by being there."""

from __future__ import annotations

import ast
import inspect
import math
from functools import cache
from importlib import import_module

import numpy as np
import pytest

from tests.engine.plants import HALF_CAR, ROAD_LOAD
from vdyn_cli import steps
from vdyn_cli.commands.contract_checks import finite_derivatives, nothing_at_zero, shipped_models, typical_constants
from vdyn_cli.commands.explain import explanation
from vdyn_cli.effects import PROPERTIES, SITUATIONS, Effect, candidates, catalog, in_other_form
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.graph import trace
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.simulate import Drive, Simulated, Simulator
from vdyn_cli.quantities.errors import ResultError
from vdyn_cli.quantities.vocabulary import PARAMETERS

EFFECTS = catalog()
EACH = pytest.mark.parametrize("effect", EFFECTS, ids=lambda effect: effect.name)


MODELS = (ROAD_LOAD, HALF_CAR, *shipped_models())
EVERY = [pytest.mark.slow, pytest.mark.thorough]
# In the scope of the module, the tests of one model follow each other and share its assembly with each effect.
IN_EACH_MODEL = pytest.mark.parametrize(
    "number", range(len(MODELS)), ids=lambda k: f"{k}-{MODELS[k].name}", scope="module"
)


@cache
def hosted(number: int) -> tuple[Effect, ...]:
    """The effects that a model can take: one pass for the whole catalog."""
    return applicable(MODELS[number], EFFECTS)


def models_that_take(effect: Effect) -> list[int]:
    return [number for number in range(len(MODELS)) if effect in hosted(number)]


def chosen(number: int) -> list[Effect]:
    """Those for which this is the one variant tried of a model: variants call the same laws."""
    last = {effect: {MODELS[k].name: k for k in models_that_take(effect)} for effect in hosted(number)}
    return [effect for effect in hosted(number) if last[effect][MODELS[number].name] == number]


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
    assert effect.tags <= PROPERTIES.keys() | SITUATIONS.keys()
    assert effect.situations


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
    coastdown, validate = (
        {one.name for one in candidates(steps.load_step(step).situations)} for step in ("coastdown", "validate")
    )
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
    assert models_that_take(effect)


@IN_EACH_MODEL
@pytest.mark.parametrize("effects", [chosen, pytest.param(hosted, marks=EVERY)], ids=["one", "all"])
def test_effects_are_exactly_nothing_at_zero(number, effects):
    """In one variant of each model, as ``vdyn test-plugin`` asks; the thorough tests try all variants."""
    wrong = {e.name: list(nothing_at_zero(e, MODELS[number])) for e in effects(number)}
    assert not any(wrong.values()), wrong


@pytest.mark.parametrize(
    "number",
    [pytest.param(k, marks=[pytest.mark.slow] if m.name == "vehicle" else []) for k, m in enumerate(MODELS)],
    ids=lambda k: f"{k}-{MODELS[k].name}",
    scope="module",
)
def test_derivatives_are_finite_at_zero_and_not_all_zero(number):
    wrong = {e.name: list(finite_derivatives(e, MODELS[number])) for e in chosen(number)}
    assert not any(wrong.values()), wrong


@pytest.mark.slow
@pytest.mark.parametrize(
    "number",
    [pytest.param(k, marks=[pytest.mark.thorough] if m.name == "vehicle" else []) for k, m in enumerate(MODELS)],
    ids=lambda k: f"{k}-{MODELS[k].name}",
)
def test_whole_trajectories_are_bit_identical_at_zero(number):
    """With fixed steps they are: no state of an effect can change the steps of the model's."""
    drive, parameters, plain = trajectory(MODELS[number])
    if plain is None:  # random numbers are no car: the moments above still hold
        return
    for effect in chosen(number):
        found = Simulator(MODELS[number], parameters, (), (effect,), backend="vm")(drive)
        for name, value in plain.outputs.items():
            assert np.array_equal(found.outputs[name], value), effect.name


def trajectory(model: Model) -> tuple[Drive, dict[str, float], Simulated | None]:
    """What drives a model, its parameters, and how it moves without any effect; None where it can't."""
    graph = trace(model)
    random = np.random.default_rng(11)
    time = np.arange(40) * 0.002
    inputs = {name: random.uniform(0, 0.1, time.size) for name in graph.inputs}
    start = {name: random.uniform(0, 0.1) for name in graph.states}
    drive = Drive(time, inputs, start, {}, {name: 1.0 + k for k, name in enumerate(model.context)})
    values = dict(zip(graph.constants, typical_constants(graph, random), strict=True))
    parameters = {name: values[name] for name in model.parameters}
    try:
        return drive, parameters, Simulator(model, parameters, backend="vm")(drive)
    except ResultError:
        return drive, parameters, None


@pytest.mark.parametrize("effect", [e for e in EFFECTS if e.other_law], ids=lambda effect: effect.name)
def test_another_form_of_a_law_is_nothing_at_zero(effect):
    other = in_other_form(effect)
    assert other.name == effect.name
    assert other.unknowns == effect.unknowns
    again = in_other_form(other)
    assert again is not None
    assert again.laws == effect.laws
    assert not list(nothing_at_zero(other, MODELS[models_that_take(effect)[0]]))
