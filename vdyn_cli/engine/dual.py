"""Forward-mode differentiation of a graph: every value has derivatives in K directions, by one table of rules.

All backends use the same rules, so that machine code and virtual machine agree. They differ from CasADi's rules in two
points: a branch not taken contributes nothing, even where its derivative is infinite (CasADi multiplies by zero and
gets nan), and ``copysign(x, y)`` has the slope of ``|x| sign(y)``.
At a tie the slope of fmax and fmin is the mean of both sides; fabs'(0) = 0.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, Protocol

import casadi as ca

Value = Any
Tangents = Any


class Algebra(Protocol):
    """How a backend computes: values are scalars, tangents are rows of K derivatives."""

    def value(self, op: int, *arguments: Value) -> Value:
        """The result of one operation of the graph; plain floats are constants."""

    def scale(self, tangents: Tangents, by: Value) -> Tangents:
        """The tangents times a value."""

    def add(self, left: Tangents, right: Tangents) -> Tangents:
        """The sum of two rows of tangents."""

    def subtract(self, left: Tangents, right: Tangents) -> Tangents:
        """The left tangents minus the right ones."""

    def negate(self, tangents: Tangents) -> Tangents:
        """The tangents times -1."""

    def choose(self, condition: Value, tangents: Tangents) -> Tangents:
        """The tangents where the condition is not 0, else 0."""


def instructions(function: ca.Function) -> Iterator[tuple[int, list[int], list[int], float]]:
    """Operation, places of outputs and inputs, and constant of each instruction of a graph, in order."""
    for k in range(function.n_instructions()):
        op = function.instruction_id(k)
        constant = function.instruction_constant(k) if op == ca.OP_CONST else 0.0
        yield op, function.instruction_output(k), function.instruction_input(k), constant


Apply = Callable[..., Value]


def _ratio_of_root(f: Apply, x: Value, sign: float) -> Value:
    return f(ca.OP_DIV, sign, f(ca.OP_SQRT, f(ca.OP_SUB, 1.0, f(ca.OP_SQ, x))))


def _pow_by_exponent(f: Apply, x: Value, v: Value) -> Value:
    """x^y log x, whose limit at x = 0 is 0."""
    return f(ca.OP_IF_ELSE_ZERO, f(ca.OP_LT, 0.0, x), f(ca.OP_MUL, v, f(ca.OP_LOG, x)))


def _first_share(f: Apply, x: Value, y: Value) -> Value:
    """1 where x > y, 1/2 at a tie, 0 below."""
    return f(ca.OP_MUL, 0.5, f(ca.OP_ADD, f(ca.OP_LT, y, x), f(ca.OP_LE, y, x)))


def _slope_of_arc_tangent(f: Apply, y: Value, x: Value, numerator: Value) -> Value:
    return f(ca.OP_DIV, numerator, f(ca.OP_ADD, f(ca.OP_SQ, x), f(ca.OP_SQ, y)))


# Partial derivatives of v = op(x) as functions (f, x, v); ``f(op, ...)`` applies an operation.
UNARY_SLOPES: dict[int, Callable[[Apply, Value, Value], Value]] = {
    ca.OP_SQ: lambda f, x, v: f(ca.OP_TWICE, x),
    ca.OP_INV: lambda f, x, v: f(ca.OP_NEG, f(ca.OP_SQ, v)),
    ca.OP_SQRT: lambda f, x, v: f(ca.OP_DIV, 0.5, v),
    ca.OP_SIN: lambda f, x, v: f(ca.OP_COS, x),
    ca.OP_COS: lambda f, x, v: f(ca.OP_NEG, f(ca.OP_SIN, x)),
    ca.OP_TAN: lambda f, x, v: f(ca.OP_ADD, 1.0, f(ca.OP_SQ, v)),
    ca.OP_ASIN: lambda f, x, v: _ratio_of_root(f, x, 1.0),
    ca.OP_ACOS: lambda f, x, v: _ratio_of_root(f, x, -1.0),
    ca.OP_ATAN: lambda f, x, v: f(ca.OP_DIV, 1.0, f(ca.OP_ADD, 1.0, f(ca.OP_SQ, x))),
    ca.OP_TANH: lambda f, x, v: f(ca.OP_SUB, 1.0, f(ca.OP_SQ, v)),
    ca.OP_EXP: lambda f, x, v: v,
    ca.OP_LOG: lambda f, x, v: f(ca.OP_INV, x),
    ca.OP_FABS: lambda f, x, v: f(ca.OP_SIGN, x),
}
# The same for v = op(x, y): derivatives to x and to y, as functions (f, x, y, v); None if zero or not needed.
BINARY_SLOPES: dict[int, tuple[Callable[..., Value], Callable[..., Value] | None]] = {
    ca.OP_MUL: (lambda f, x, y, v: y, lambda f, x, y, v: x),
    ca.OP_POW: (
        lambda f, x, y, v: f(ca.OP_MUL, y, f(ca.OP_POW, x, f(ca.OP_SUB, y, 1.0))),
        lambda f, x, y, v: _pow_by_exponent(f, x, v),
    ),
    ca.OP_CONSTPOW: (lambda f, x, y, v: f(ca.OP_MUL, y, f(ca.OP_POW, x, f(ca.OP_SUB, y, 1.0))), None),
    ca.OP_ATAN2: (
        lambda f, y, x, v: _slope_of_arc_tangent(f, y, x, x),
        lambda f, y, x, v: f(ca.OP_NEG, _slope_of_arc_tangent(f, y, x, y)),
    ),
    ca.OP_FMAX: (lambda f, x, y, v: _first_share(f, x, y), lambda f, x, y, v: _first_share(f, y, x)),
    ca.OP_FMIN: (lambda f, x, y, v: _first_share(f, y, x), lambda f, x, y, v: _first_share(f, x, y)),
    ca.OP_COPYSIGN: (lambda f, x, y, v: f(ca.OP_MUL, f(ca.OP_SIGN, x), f(ca.OP_COPYSIGN, 1.0, y)), None),
}
ZERO_SLOPE = frozenset(
    (ca.OP_LT, ca.OP_LE, ca.OP_EQ, ca.OP_NE, ca.OP_AND, ca.OP_OR, ca.OP_NOT, ca.OP_SIGN, ca.OP_FLOOR, ca.OP_CEIL)
)
LINEAR = frozenset((ca.OP_ADD, ca.OP_SUB, ca.OP_NEG, ca.OP_TWICE, ca.OP_ASSIGN, ca.OP_IF_ELSE_ZERO))
SUPPORTED = ZERO_SLOPE | LINEAR | UNARY_SLOPES.keys() | BINARY_SLOPES.keys() | {ca.OP_DIV}


def tangent(algebra: Algebra, op: int, a: Sequence[Value], v: Value, t: Sequence[Tangents | None]) -> Tangents | None:
    """The tangents of ``v = op(*a)`` from the tangents ``t`` of its arguments; None stands for zero.

    Parameters
    ----------
    op : operation code of CasADi. a : its arguments. v : its value. t : tangents of each argument.
    """
    if op in ZERO_SLOPE or all(tangents is None for tangents in t):
        return None
    if op == ca.OP_DIV:
        moved = t[0] if t[1] is None else _linear(algebra, ca.OP_SUB, a, (t[0], algebra.scale(t[1], v)))
        return algebra.scale(moved, algebra.value(ca.OP_INV, a[1]))
    if op in LINEAR:
        return _linear(algebra, op, a, t)
    if op in UNARY_SLOPES:
        return algebra.scale(t[0], UNARY_SLOPES[op](algebra.value, a[0], v))
    parts = [
        algebra.scale(tangents, slope(algebra.value, *a, v))
        for tangents, slope in zip(t, BINARY_SLOPES[op], strict=True)
        if tangents is not None and slope is not None
    ]
    return algebra.add(*parts) if len(parts) == 2 else next(iter(parts), None)


def _linear(algebra: Algebra, op: int, a: Sequence[Value], t: Sequence[Tangents | None]) -> Tangents | None:
    if op == ca.OP_ASSIGN:
        return t[0]
    if op == ca.OP_IF_ELSE_ZERO:
        return None if t[1] is None else algebra.choose(a[0], t[1])
    if op == ca.OP_NEG:
        return algebra.negate(t[0])
    if op == ca.OP_TWICE:
        return algebra.add(t[0], t[0])
    left, right = t
    if right is None:
        return left
    if left is None:
        return right if op == ca.OP_ADD else algebra.negate(right)
    return algebra.add(left, right) if op == ca.OP_ADD else algebra.subtract(left, right)


def refuse_unknown_operations(function: ca.Function) -> None:
    """Raise NotImplementedError where a law uses a function that engine/maths.py does not provide."""
    plain = (ca.OP_CONST, ca.OP_INPUT, ca.OP_OUTPUT)
    for op, _, _, _ in instructions(function):
        if op not in plain and op not in SUPPORTED:
            name = next((name for name in dir(ca) if name.startswith("OP_") and getattr(ca, name) == op), str(op))
            raise NotImplementedError(
                f"{name[3:].lower()} has no derivative rule in engine/dual.py: use the functions of engine/maths.py"
            )
