"""Contract checks of an effect, a step or a reader, for ``vdyn test-plugin NAME`` and for vdyn's own tests.

Each check is a generator that yields a sentence for each fault; a check that yields nothing has passed.
"""

from __future__ import annotations

import inspect
import math
import pkgutil
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from importlib import import_module
from itertools import combinations_with_replacement, product
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np

import vdyn_cli.physics.models
from vdyn_cli import effects, steps
from vdyn_cli.description.description_model import Description
from vdyn_cli.description.yaml_source import load_yaml
from vdyn_cli.effects import PROPERTIES, Effect
from vdyn_cli.engine.applicable import applicable
from vdyn_cli.engine.graph import Graph, trace
from vdyn_cli.engine.model import Model
from vdyn_cli.io.reader import Column, Reader, ReadOptions, is_clock
from vdyn_cli.physics.models.vehicle import vehicle
from vdyn_cli.project.inputs import gather
from vdyn_cli.project.result_document import StepRecord, provenance_of, to_json
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, InputError, VdynError
from vdyn_cli.quantities.quantity import UnitError, to_si
from vdyn_cli.steps import Problem, SimulatedProblem, Step

Check = Callable[[], Iterator[str]]

# Typical values of a car, so that roots and quotients of them are defined; other constants are of the order of one.
TYPICAL: Mapping[str, float] = {
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
    "read_radius": 0.3,
    "road_begin": -20.0,
    "road_end": 20.0,
}
UNEVEN = 0.3  # relative variation of typical values between moments, so that no check passes by a special value
MOMENTS = 60  # standstill, reverse and forward, twenty times each


@dataclass(frozen=True)
class Outcome:
    """Name of a check, and its faults; none if it passed."""

    name: str
    wrong: tuple[str, ...]


def outcomes(checks: Mapping[str, Check]) -> tuple[Outcome, ...]:
    """Run checks in order; a check that raises has failed, and the others still run."""
    found = []
    for name, check in checks.items():
        try:
            wrong = tuple(check())
        except VdynError as error:
            wrong = tuple(str(f) for f in error.findings)
        except Exception as error:  # a plug-in may raise anything
            wrong = (f"{type(error).__name__}: {error}",)
        found.append(Outcome(name, wrong))
    return tuple(found)


def effect_checks(effect: Effect, models: Sequence[Model]) -> Mapping[str, Check]:
    """The contract of an effect, checked in the given models to which it applies; without models, in those of vdyn."""
    called = f"{' or '.join(effect.on)}: give the description of a test whose model calls it"
    able = one_of_each(models_that_take(effect, models or shipped_models()))
    return {
        "texts": lambda: _effect_texts(effect),
        "units and ranges": lambda: _ranges(effect),
        "tags are known": lambda: _tags(effect),
        "a model can take it": lambda: iter(() if able else (f"no model calls {called}",)),
        "nothing at zero": lambda: (w for model in able for w in nothing_at_zero(effect, model)),
        "derivatives are finite at zero": lambda: (w for model in able for w in finite_derivatives(effect, model)),
    }


def step_checks(step: Step, example: Path, known_files: Sequence[Path]) -> Mapping[str, Check]:
    """The contract of a step, checked with an example description and the parameter files that it needs."""
    inputs = gather(step, example, known_files)
    step = inputs.step

    def prepared() -> Problem:
        return step.prepare(inputs.spec, inputs.data, inputs.known)

    problem = prepared()
    results = [p.publish() for p in (problem, problem, prepared())]
    documents = {to_json(StepRecord(r, provenance_of(inputs, "", known_files)).document) for r in results}
    found = results[0].parameters
    checks: dict[str, Check] = {
        "docstring": lambda: iter(() if steps.summary(step.name) else ("its module has no docstring",)),
        "schema has descriptions": lambda: _undescribed(step),
        "publishes the same result twice": lambda: iter(() if len(documents) == 1 else ("two results differ",)),
        "gives the parameters that it lists": lambda: (f"{n} is not in 'gives'" for n in found if n not in step.gives),
    }
    if (simulated := steps.simulated_problem(step, problem)) is not None:
        checks["problem protocol"] = lambda: _protocol(simulated)
        checks["regression is finite"] = lambda: _finite_regression(simulated)
    return checks


def reader_checks(reader: Reader, log: Path) -> Mapping[str, Check]:
    """The contract of a reader, checked with a log of its format."""
    infos = reader.channels(log)
    names = [(c.name, c.group) for c in infos]
    clock = next((c for c in infos if is_clock(c.name)), infos[0])
    mapping = {("time" if c is clock else c.name): Column(c.name, c.unit, c.unit) for c in infos}
    first, second = (reader.read(log, mapping, ReadOptions(), log.name) for _ in range(2))

    def same() -> Iterator[str]:
        if set(first.channels) != set(mapping) - {"time"}:
            yield "does not read every channel that it lists"
        for channel in ("time", *first.channels):
            if not np.array_equal(first[channel], second[channel], equal_nan=True):
                yield f"reads {channel} differently the second time"

    return {
        "matches": lambda: iter(() if reader.matches(log) else (f"does not match {log.name}",)),
        "does not match a missing file": lambda: iter(
            ("matches a missing file",) if reader.matches(log / "none") else ()
        ),
        "channels have names": lambda: (
            f"{n[0]!r} is empty or listed twice" for n in names if not n[0] or names.count(n) > 1
        ),
        "reads the same log twice": same,
        "states the line of each sample": lambda: iter(() if first.source else ("the log has no source",)),
    }


def model_of(example: Path, known_files: Sequence[Path]) -> Model:
    """The model that simulates an example description.

    Raises
    ------
    InputError : the description is wrong, or its step is unknown or has no simulation.
    """
    data = load_yaml(example).data
    test = data.get("test") if isinstance(data, dict) else None
    if test not in steps.names():
        raise InputError(Finding(example.name, "'test' is not a step", repr(test), "write 'test:' with a step's name"))
    step = steps.load_step(str(test))
    inputs = gather(step, example, known_files)
    step = inputs.step
    problem = steps.simulated_problem(step, step.prepare(inputs.spec, inputs.data, inputs.known))
    if problem is None:
        raise InputError(Finding(example.name, "its step has no simulation", step.name))
    return problem.model


def shipped_models() -> tuple[Model, ...]:
    """Every model of vdyn with each pair of its options' choices, but only two variants of the vehicle."""
    found: list[Model] = []
    for module in pkgutil.iter_modules(vdyn_cli.physics.models.__path__):
        for value in vars(import_module(f"vdyn_cli.physics.models.{module.name}")).values():
            if isinstance(value, Model):
                found.append(value)
            elif callable(value) and getattr(value, "__module__", "").startswith("vdyn_cli.physics.models"):
                found += _variants(value)
    others = [model for model in found if model.name != "vehicle"]
    return (*others, vehicle(), vehicle("rear", "sides", located=True, graded="sensor"))


def _variants(function: Any) -> list[Model]:
    """Models that a function can return, if all its arguments are choices; else none.

    Every pair of choices is in one of them: an effect calls one or two laws, which few options change.
    """
    made = inspect.unwrap(function)
    if getattr(made, "__annotations__", {}).get("return") not in (Model, "Model"):
        return []
    hints = get_type_hints(made)
    del hints["return"]
    literal = {name: get_args(hint) for name, hint in hints.items() if get_origin(hint) is Literal}
    choices = {name: (False, True) if hint is bool else literal.get(name, ()) for name, hint in hints.items()}
    if not all(choices.values()):
        return []
    made_models, tried = [], set[frozenset[tuple[int, Any]]]()
    for chosen in product(*choices.values()):
        pairs = {frozenset(pair) for pair in combinations_with_replacement(enumerate(chosen), 2)}
        if pairs - tried:
            made_models.append(function(**dict(zip(choices, chosen, strict=True))))
            tried |= pairs
    return made_models


def models_that_take(effect: Effect, models: Sequence[Model]) -> list[Model]:
    """The models to which an effect applies."""
    return [model for model in models if applicable(model, (effect,))]


def one_of_each(models: Sequence[Model]) -> list[Model]:
    """One variant of each model, because variants call the same laws."""
    return list({model.name: model for model in models}.values())


def moments(graph: Graph, count: int = MOMENTS) -> tuple[Array, Array, Array]:
    """Random states (n, count), inputs (m, count) and constants (k, count): at standstill, in reverse, and forward."""
    random = np.random.default_rng(7)
    found = []
    for k in range(count):
        x = random.normal(size=len(graph.states)) * (0, 1, 10)[k % 3]
        u = random.normal(size=len(graph.inputs)) * (0, 0.1, 1)[k // 3 % 3]
        x = np.where(np.array(graph.states) == "position", random.uniform(-25, 25, x.size), x)
        u = np.where(np.array(graph.inputs) == "position", random.uniform(-25, 25, u.size), u)
        found.append((x, u, typical_constants(graph, random)))
    x, u, p = (np.column_stack(values) for values in zip(*found, strict=True))
    return x, u, p


def typical_constants(graph: Graph, random: np.random.Generator) -> Array:
    """Random values of all constants (k,), typical of a car for those in TYPICAL."""
    uneven = random.uniform(1 - UNEVEN, 1 + UNEVEN, len(graph.constants))
    plain = random.uniform(0.2, 2.0, len(graph.constants))
    typical = np.array([TYPICAL.get(name, np.nan) for name in graph.constants])
    return np.where(np.isnan(typical), plain, typical * uneven)


def at_zero(graph: Graph, effect: Effect, constants: Array) -> Array:
    """The constants (k, count) with the effect's unknowns at their neutral values: nominal, else zero."""
    changed = constants.copy()
    for name, value in {**graph.defaults, **dict.fromkeys(effect.unknowns, 0.0), **effect.nominal}.items():
        changed[graph.constants.index(name)] = value
    return changed


def nothing_at_zero(effect: Effect, model: Model) -> Iterator[str]:
    """Faults if the model's rates and readings with the effect at zero are not bit-identical to those without it."""
    base, extended = trace(model), trace(model, (effect,))
    own = [i for i, name in enumerate(extended.states) if name in base.states]
    inputs = [extended.inputs.index(name) for name in base.inputs]
    x, u, p = moments(extended)
    p = at_zero(extended, effect, p)
    known = p[[extended.constants.index(name) for name in base.constants]]
    rates, readings = (value.full() for value in extended.field(x, u, p))
    plain_rates, plain_readings = (value.full() for value in base.field(x[own], u[inputs], known))
    kept = len(base.outputs)
    if not np.array_equal(rates[own], plain_rates, equal_nan=True):
        yield f"{model.name}: changes the rates of the states at zero"
    elif not np.array_equal(readings[:kept], plain_readings[:kept], equal_nan=True):
        yield f"{model.name}: changes the readings at zero"
    elif readings[len(extended.outputs) + len(extended.rated) :].any():
        yield f"{model.name}: shifts a clock at zero"


def finite_derivatives(effect: Effect, model: Model) -> Iterator[str]:
    """Faults of the derivatives at zero: all must be finite, and without probes each amplitude's must not vanish."""
    graph = trace(model, (effect,))
    jacobian = graph.field.jacobian()
    columns = [graph.constants.index(name) for name in (*model.parameters, *effect.unknowns)]
    first = len(model.parameters)
    count = max(MOMENTS, 8 * len(effect.unknowns))
    x, u, p = moments(graph, count)
    p = at_zero(graph, effect, p)
    plain = graph.field(x, u, p)
    # The blocks of the derivatives to the constants: the last of three inputs, for each of two outputs.
    blocks = jacobian(x, u, p, *plain)
    slopes = np.vstack([blocks[i].full().reshape(-1, count, len(p)) for i in (2, 5)])[:, :, columns]
    # Where the model itself is defined for the random numbers.
    defined = np.all([np.isfinite(value.full()).all(axis=0) for value in plain], axis=0)
    defined &= np.isfinite(slopes[:, :, :first]).all(axis=(0, 2))
    own = slopes[:, defined, first:]
    if not np.isfinite(own).all():
        yield f"{model.name}: a derivative at zero is not finite"
        return
    amplitudes = [(k, name) for k, name in enumerate(effect.unknowns) if name not in effect.nominal]
    silent = [name for k, name in amplitudes if not own[:, :, k].any()]
    if silent and not effect.probes:
        yield f"{model.name}: {', '.join(silent)} changes nothing; state probes if its derivative at zero is zero"


def _effect_texts(effect: Effect) -> Iterator[str]:
    for name in ("summary", "signature", "confirm"):
        text = getattr(effect, name)
        if len(text) <= 20 or not text.endswith("."):
            yield f"{name} is not a sentence"
    if len(effect.reference) <= 10:
        yield "reference does not name a source"
    if not effect.label or effect.label.endswith("."):
        yield "label is not a noun phrase"


def _ranges(effect: Effect) -> Iterator[str]:
    if not effect.unknowns or set(effect.nominal) >= set(effect.unknowns):
        yield "no unknown is an amplitude (zero without the effect)"
    for name, quantity in effect.unknowns.items():
        start = effect.nominal.get(name, 0.0)
        try:
            to_si(1.0, quantity.unit, quantity.unit)
        except UnitError as error:
            yield f"{name}: {error}"
        if not (math.isfinite(quantity.lower) and math.isfinite(quantity.upper) and quantity.lower < quantity.upper):
            yield f"{name}: its range is not finite"
        elif not quantity.lower <= start <= quantity.upper:
            yield f"{name}: {start:g} lies outside its range"
        if not quantity.meaning:
            yield f"{name}: has no meaning"


def _tags(effect: Effect) -> Iterator[str]:
    known = set(PROPERTIES) | set(effects.SITUATIONS)
    if unknown := effect.tags - known:
        for name in steps.names():
            unknown -= steps.load_step(name).situations
    yield from (f"{tag}: neither a property nor the situation of an installed step" for tag in sorted(unknown))


def _undescribed(step: Step) -> Iterator[str]:
    """The step's keys without a description, except those that ``Description`` defines for every step."""
    schema, shared = step.spec.model_json_schema(), Description.model_json_schema()
    models = {"": schema, **{n: m for n, m in schema.get("$defs", {}).items() if n not in shared["$defs"]}}
    for model, part in models.items():
        for key, value in part.get("properties", {}).items():
            if (model or key not in shared["properties"]) and not value.keys() & {"description", "$ref"}:
                yield f"{model}.{key} has no description".lstrip(".")


def _protocol(problem: SimulatedProblem) -> Iterator[str]:
    for name in ("model", "profiles", "regression", "publish", "likely_size", "plans"):
        if not hasattr(problem, name):
            yield f"the problem has no {name}"


def _finite_regression(problem: SimulatedProblem) -> Iterator[str]:
    regression = problem.regression()
    start = regression.start()
    for run, name in enumerate(regression.runs):
        rows = regression.rows(run, regression.local(start, run))
        if not (np.isfinite(rows.residual).all() and np.isfinite(rows.jacobian).all()):
            yield f"{name}: residuals or derivatives at the start are not finite"
