"""Linearization of a model about a steady state: the state, its eigenvalues, and their derivatives to parameters.

All derivatives are exact, also those of the eigenvalues: the Jacobian depends on a parameter directly and through the
steady state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import casadi as ca
import numpy as np

from vdyn_cli.engine.graph import Graph, refuse_unknown, trace
from vdyn_cli.engine.model import Model
from vdyn_cli.quantities.arrays import Array
from vdyn_cli.quantities.errors import Finding, ResultError

MOST_STEPS = 60
ARRIVED = 1e-11  # weighted norm of the rates below which a step need not reduce it


@dataclass(frozen=True)
class Root:
    """One eigenvalue of a linearized model.

    Parameters
    ----------
    value : s, 1/s; the motion is proportional to exp(s t).
    shape : right eigenvector, each state in its own unit; the state with the largest participation is 1.
    participation : participation factor |left x right| of each state; the sum is 1. It has no unit, so that meters and
        radians are comparable.
    slopes : derivative of ``value`` to each constant of the model.
    """

    value: complex
    shape: Mapping[str, complex]
    participation: Mapping[str, float]
    slopes: Mapping[str, complex]


@dataclass(frozen=True, eq=False)
class SteadyState:
    """A steady state and the linear model about it, x' = A x.

    Parameters
    ----------
    states : values of all states; those on which nothing depends, such as the position, keep their start value.
    inputs : values of all inputs, including the free ones.
    roots : the eigenvalues with an imaginary part >= 0, in the order of their magnitude.
    """

    states: Mapping[str, float]
    inputs: Mapping[str, float]
    roots: tuple[Root, ...]


def steady(
    model: Model,
    parameters: Mapping[str, float],
    inputs: Mapping[str, float],
    held: Mapping[str, float] | None = None,
    free: Sequence[str] = (),
    context: Mapping[str, float] | None = None,
) -> SteadyState:
    """The steady state of a model, and its eigenvalues.

    Solves f(x, u, p) = 0 by Newton's method for the states that are not held and the inputs that are free;
    ds/dp = w' (dA/dp) v / (w' v) for left and right eigenvectors w, v, including the steady state's dx/dp.

    Parameters
    ----------
    model, parameters : the model and the values of all its parameters, SI.
    inputs : values of its inputs; start values of the free ones.
    held : states with a given value and zero rate, such as the speed of a cruise.
    free : inputs to solve for, such as the torque that holds the speed; as many as held states.
    context : the model's context.

    Raises
    ------
    ResultError : there is no steady state near the model's start.
    ValueError : a name is not known or has no value.
    """
    held, context = dict(held or {}), dict(context or {})
    graph = trace(model)
    refuse_unknown(f"input of {model.name}", (*inputs, *free), graph.inputs)
    refuse_unknown(f"state of {model.name}", held, graph.states)
    values = {**graph.defaults, **parameters, **context}
    if missing := [n for n in graph.constants if n not in values] + [n for n in graph.inputs if n not in inputs]:
        raise ValueError(f"model {model.name!r} needs a value for {', '.join(missing)}")
    p = np.array([values[name] for name in graph.constants], dtype=np.float64)
    u = np.array([inputs[name] for name in graph.inputs], dtype=np.float64)
    active = _active(graph)
    places = _UnknownIndices(graph, active, held, free)
    x, u = _newton_solution(model, graph, places, _start(graph, held, u, p), u, p)
    on_x = np.asarray(graph.slopes(x, u, p, 0, 0)[0])[np.ix_(active, active)]
    return SteadyState(
        dict(zip(graph.states, x.tolist(), strict=True)),
        dict(zip(graph.inputs, u.tolist(), strict=True)),
        _roots(graph, places, on_x, x, u, p),
    )


def _active(graph: Graph) -> list[int]:
    """Indices of the states on which other rates depend; a pure integrator such as a position is not among them."""
    depends = np.asarray(ca.DM(graph.field.jac_sparsity(0, 0), 1.0)) > 0
    active = list(range(len(graph.states)))
    while idle := [i for i in active if not depends[active, i].any()]:
        active = [i for i in active if i not in idle]
    return active


class _UnknownIndices:
    """Indices in x and u of the unknowns of the steady state, and of the rates that must vanish."""

    def __init__(self, graph: Graph, active: list[int], held: Mapping[str, float], free: Sequence[str]) -> None:
        self.active = active
        self.x = [i for i in active if graph.states[i] not in held]
        self.u = [graph.inputs.index(name) for name in free]

    def derivatives(self, slopes: ca.Function, x: Array, u: Array, p: Array) -> tuple[Array, Array]:
        """Derivatives of the rates to the unknowns, (m, n), and to the constants, (m, p)."""
        on_x, on_u, on_p = (np.asarray(block)[self.active] for block in list(slopes(x, u, p, 0, 0))[:3])
        return np.hstack([on_x[:, self.x], on_u[:, self.u]]), on_p


def _start(graph: Graph, held: Mapping[str, float], u: Array, p: Array) -> Array:
    given = {**graph.starts, **held}
    x = np.array([given.get(name, 0.0) for name in graph.states], dtype=np.float64)
    start: Array = np.asarray(graph.start(frozenset(given))(x, u, p)[0])[:, 0]
    return start


def _newton_solution(
    model: Model, graph: Graph, places: _UnknownIndices, x: Array, u: Array, p: Array
) -> tuple[Array, Array]:
    """Newton's method; a step is halved while the norm of the rates, each over its largest derivative, grows."""
    field = graph.field
    weights: Array | None = None
    count = len(places.x)
    for _ in range(MOST_STEPS):
        rates = np.asarray(field(x, u, p)[0])[places.active, 0]
        slopes, _ = places.derivatives(graph.slopes, x, u, p)
        if not (np.isfinite(rates).all() and np.isfinite(slopes).all()):
            break
        weights = 1.0 / np.maximum(np.abs(slopes).max(axis=1, initial=0.0), 1e-12) if weights is None else weights
        step = np.linalg.lstsq(slopes * weights[:, None], -rates * weights, rcond=1e-13)[0]
        before = float(np.linalg.norm(rates * weights))
        for halving in range(30):
            part = 0.5**halving
            to_x, to_u = x.copy(), u.copy()
            to_x[places.x] += part * step[:count]
            to_u[places.u] += part * step[count:]
            after = float(np.linalg.norm(np.asarray(field(to_x, to_u, p)[0])[places.active, 0] * weights))
            if after <= before or after < ARRIVED:
                break
        x, u = to_x, to_u
        sizes = 1.0 + np.abs(np.concatenate([x[places.x], u[places.u]]))
        if np.all(np.abs(step) < 1e-9 * sizes) and after < 1e-6:
            return x, u
    raise ResultError(
        Finding(
            f"model {model.name!r}",
            "no steady state was found near its start",
            remedy="check the parameters: the car may not be able to hold this speed",
        )
    )


def _roots(graph: Graph, places: _UnknownIndices, matrix: Array, x: Array, u: Array, p: Array) -> tuple[Root, ...]:
    values, right = np.linalg.eig(matrix)
    left = np.linalg.pinv(right).conj().T  # columns, scaled so that left' right = 1
    slope = graph.root_slopes
    to_z, to_p = places.derivatives(graph.slopes, x, u, p)
    moves = -np.asarray(np.linalg.lstsq(to_z, to_p, rcond=1e-13)[0])  # d (steady state) / d constants
    names = [graph.states[i] for i in places.active]
    found = []
    for k in np.argsort(np.abs(values)):
        if values[k].imag < 0:
            continue
        v, w = np.zeros(x.size, complex), np.zeros(x.size, complex)
        v[places.active], w[places.active] = right[:, k], left[:, k]
        by_x, by_u, by_p = (
            np.asarray(real)[:, 0] + 1j * np.asarray(imaginary)[:, 0]
            for real, imaginary in zip(*_halves(slope(x, u, p, v.real, v.imag, w.real, w.imag)), strict=True)
        )
        total = by_p + np.concatenate([by_x[places.x], by_u[places.u]]) @ moves
        share = np.abs(right[:, k] * left[:, k])
        share = share / share.sum()
        largest = right[np.argmax(share), k]
        found.append(
            Root(
                complex(values[k]),
                dict(zip(names, (right[:, k] / largest).tolist(), strict=True)),
                dict(zip(names, share.tolist(), strict=True)),
                dict(zip(graph.constants, total.tolist(), strict=True)),
            )
        )
    return tuple(found)


def _halves(six: Sequence[ca.DM]) -> tuple[Sequence[ca.DM], Sequence[ca.DM]]:
    return six[:3], six[3:]
