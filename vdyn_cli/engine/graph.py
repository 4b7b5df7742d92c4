"""Tracing of a model and its effects to one symbolic graph."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from difflib import get_close_matches
from functools import cached_property, lru_cache
from typing import Any

import casadi as ca
import numpy as np

from vdyn_cli.engine.dual import refuse_unknown_operations
from vdyn_cli.engine.lead import leads_of, now_of, slope_of
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction, ModelBuilder, Number, Signals


@dataclass(frozen=True, eq=False)
class Graph:
    """A traced model.

    ``field(x, u, p) -> (rates of the states, readings)``: the constants ``p`` are the model's parameters,
    the effects' unknowns and the context, in the order of ``constants``. The readings are the outputs, followed by the
    rates of those in ``rated`` and the clock shifts of those in ``shifted``. The rate of an output that is shifted but
    not rated must be computed from its trace. ``leads(p)`` returns the lead or lag of each pair (input, kind) in
    ``leading`` (see ``lead.py``).
    """

    states: tuple[str, ...]
    inputs: tuple[str, ...]
    constants: tuple[str, ...]
    defaults: Mapping[str, float]
    starts: Mapping[str, float]
    outputs: tuple[str, ...]
    shifted: tuple[str, ...]
    rated: tuple[str, ...]
    field: ca.Function
    leading: tuple[tuple[str, str], ...]
    leads: ca.Function
    _symbols: tuple[ca.SX, ca.SX, ca.SX]
    _start_laws: Mapping[str, ca.SX]

    @property
    def readings(self) -> int:
        """Number of readings that the field returns."""
        return int(self.field.size1_out(1))

    @cached_property
    def slopes(self) -> ca.Function:
        """``(x, u, p, 0, 0) -> derivatives`` of rates and readings to x, u and p, one block each."""
        return self.field.jacobian()

    @cached_property
    def root_slopes(self) -> ca.Function:
        """Gradients of w' A v to (x, u, p), A = d rates/dx, real and imaginary part, for given v and w."""
        x, u, p = (ca.SX.sym(self.field.name_in(k), *self.field.size_in(k)) for k in range(3))
        v_re, v_im, w_re, w_im = (ca.SX.sym(name, x.numel()) for name in ("vr", "vi", "wr", "wi"))
        rates = self.field(x, u, p)[0]
        forward_re, forward_im = ca.jtimes(rates, x, v_re), ca.jtimes(rates, x, v_im)
        real = ca.dot(w_re, forward_re) + ca.dot(w_im, forward_im)
        imaginary = ca.dot(w_re, forward_im) - ca.dot(w_im, forward_re)
        gradients = [ca.densify(ca.gradient(part, to)) for part in (real, imaginary) for to in (x, u, p)]
        return ca.Function("slopes", [x, u, p, v_re, v_im, w_re, w_im], gradients, {"cse": True})

    def start(self, given: frozenset[str]) -> ca.Function:
        """``(x, u, p) -> (x0, dx0/d(x, p))``: the ``given`` starts are taken from x, the others from their laws."""
        x, u, p = self._symbols
        starts = ca.SX(x)
        for i, name in enumerate(self.states):
            if name not in given:
                starts[i] = ca.substitute(self._start_laws[name], x, starts)
        return ca.Function("start", [x, u, p], [starts, ca.densify(ca.jacobian(starts, ca.vertcat(x, p)))])

    def live(self, seeded_starts: frozenset[int], seeded_constants: frozenset[int]) -> frozenset[int]:
        """Indices of the states whose derivatives to the seeded starts and constants (indices, too) can be nonzero."""
        on_states, on_constants = (ca.DM(self.field.jac_sparsity(0, k), 1.0).full() > 0 for k in (0, 2))
        reached = on_constants[:, sorted(seeded_constants)].any(axis=1)
        reached[sorted(seeded_starts)] = True
        # A start that is an expression may depend on anything.
        reached |= np.array([name in self._start_laws for name in self.states], dtype=bool)
        while (wider := reached | on_states[:, reached].any(axis=1)).sum() > reached.sum():
            reached = wider
        return frozenset(int(i) for i in np.flatnonzero(reached))


def closest(name: str, known: Iterable[str]) -> str:
    """Hint for an unknown name: the closest known one, or all of them."""
    names = list(known)
    near = get_close_matches(name, names, n=1)
    return f"did you mean {near[0]!r}?" if near else f"there are: {', '.join(sorted(names)) or 'none'}"


def refuse_unknown(what: str, names: Iterable[str], known: Iterable[str]) -> None:
    """Raise ValueError, with a hint, for the first name that is not known; ``what`` says what the names are."""
    known = tuple(known)
    for name in names:
        if name not in known:
            raise ValueError(f"{what} {name!r} is not known; {closest(name, known)}")


def symbols(names: Iterable[str]) -> dict[str, Any]:
    """One scalar symbol for each name."""
    return {name: ca.SX.sym(name) for name in names}


def column(values: Iterable[Number]) -> ca.SX:
    """A dense column of symbols or plain numbers; (0, 1) for none."""
    listed = list(values)
    return ca.densify(ca.vertcat(*listed)) if listed else ca.SX(0, 1)


def constants_of(model: Model, effects: Iterable[Correction]) -> dict[str, float]:
    """The effects' unknowns with their neutral values, SI.

    Raises
    ------
    ValueError : two effects share an unknown, or one has the name of a parameter of the model.
    """
    defaults: dict[str, float] = {}
    for effect in effects:
        for name in effect.unknowns:
            if name in defaults or name in model.parameters or name in model.context:
                raise ValueError(f"the unknown {name!r} of effect {effect.name!r} has a name that is already taken")
            defaults[name] = float(effect.nominal.get(name, 0.0))
    return defaults


@lru_cache(maxsize=64)
def trace(model: Model, effects: tuple[Correction, ...] = ()) -> Graph:
    """Assemble a model with its effects on symbols; the same arguments are traced once.

    Raises
    ------
    MissingSignalError : an effect needs a signal that the model does not have.
    ValueError : an effect corrects a law that the model never calls; a state has no rate or a rate no state.
    """
    defaults = constants_of(model, effects)
    p, q, u, c = symbols(model.parameters), symbols(defaults), symbols(model.inputs), symbols(model.context)
    x: dict[str, ca.SX] = {}
    starts: dict[str, Number] = {}

    def read(name: str, start: Number) -> Number:
        if name not in x:
            x[name], starts[name] = ca.SX.sym(name), start
        return x[name]

    builder = ModelBuilder(read, p, q, effects, c)
    leads = leads_of(builder, model.inputs)
    model.assemble(builder, Signals(**leads.applied(u)))
    builder.finish(lambda of: ca.jtimes(ca.SX(of), *_moving(x, builder.rates)))
    if unmet := [effect.name for effect in effects if effect.name not in builder.met]:
        raise ValueError(f"model {model.name!r} has no element for the effect {', '.join(unmet)}")
    if odd := set(builder.rates) ^ set(x):
        raise ValueError(
            f"model {model.name!r}: every state needs one rate, every rate one state: wrong for {sorted(odd)}"
        )
    u |= {slope_of(*key): slope for key, slope in leads.slope.items()}
    now = {now_of(*key): value for key, value in leads.now.items()}
    constants = {**p, **q, **now, **c}
    rates = column(builder.rates[name] for name in x)
    refuse_unknown(f"output of {model.name}", model.outputs, builder.outputs)
    read_outputs = {n: o for n, o in builder.outputs.items() if n in (model.outputs or builder.outputs)}
    readings = _readings(read_outputs, column(x.values()), rates, column(u.values()))
    shifted = tuple(name for name, (_, _, shift) in readings.items() if not shift.is_zero())
    rated = tuple(name for name in shifted if readings[name][1] is not None)
    read_out = column(
        [value for value, _, _ in readings.values()]
        + [readings[name][1] for name in rated]
        + [readings[name][2] for name in shifted]
    )
    laws = {name: ca.SX(start) for name, start in starts.items() if not ca.SX(start).is_constant()}
    names = (column(x.values()), column(u.values()), column(constants.values()))
    field = ca.Function("field", list(names), [rates, read_out], {"cse": True})
    refuse_unknown_operations(field)
    return Graph(
        states=tuple(x),
        inputs=tuple(u),
        constants=tuple(constants),
        defaults={**defaults, **dict.fromkeys(now, 0.0)},
        starts={name: float(start) for name, start in starts.items() if name not in laws},
        outputs=tuple(readings),
        shifted=shifted,
        rated=rated,
        field=field,
        leading=tuple(leads.law),
        leads=ca.Function("leads", [names[2]], [column(leads.law.values())]),
        _symbols=names,
        _start_laws=laws,
    )


def _moving(x: Mapping[str, ca.SX], rates: Mapping[str, Number]) -> tuple[ca.SX, ca.SX]:
    """The states and their rates, as columns."""
    return column(x.values()), column(rates.get(name, 0.0) for name in x)


def _readings(
    outputs: Mapping[str, tuple[Number, Number | None, Number]], x: ca.SX, rates: ca.SX, u: ca.SX
) -> dict[str, tuple[ca.SX, ca.SX | None, ca.SX]]:
    """Value, rate and clock shift of each output; of shifted outputs that depend on states only, the exact rate."""
    found = {}
    for name, (value, rate, shift) in outputs.items():
        value, shift = ca.SX(value), ca.SX(shift)
        if not shift.is_zero() and x.numel() and not (u.numel() and ca.depends_on(value, u)):
            rate = ca.jtimes(value, x, rates)
        found[name] = (value, None if rate is None else ca.SX(rate), shift)
    return found
