"""The values of a graph as lines of C, one named value per line."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import casadi as ca

from vdyn_cli.engine.evaluation_order import LIBM, EvaluationOrder

_INFIX = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
_COMPARISONS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
_FUNCTIONS = {
    **LIBM,
    ca.OP_SQRT: "sqrt",
    ca.OP_FABS: "fabs",
    ca.OP_FLOOR: "floor",
    ca.OP_CEIL: "ceil",
    ca.OP_FMAX: "fmax",
    ca.OP_FMIN: "fmin",
    ca.OP_COPYSIGN: "copysign",
}
_OTHERS: Mapping[int, Callable[[Sequence[str]], str]] = {
    ca.OP_ASSIGN: lambda a: a[0],
    ca.OP_SQ: lambda a: f"{a[0]} * {a[0]}",
    ca.OP_TWICE: lambda a: f"{a[0]} + {a[0]}",
    ca.OP_NEG: lambda a: f"-{a[0]}",
    ca.OP_INV: lambda a: f"1.0 / {a[0]}",
    ca.OP_NOT: lambda a: f"({a[0]} == 0.0) ? 1.0 : 0.0",
    ca.OP_AND: lambda a: f"({a[0]} != 0.0 && {a[1]} != 0.0) ? 1.0 : 0.0",
    ca.OP_OR: lambda a: f"({a[0]} != 0.0 || {a[1]} != 0.0) ? 1.0 : 0.0",
    ca.OP_SIGN: lambda a: f"({a[0]} < 0.0) ? -1.0 : (({a[0]} > 0.0) ? 1.0 : {a[0]})",
    ca.OP_IF_ELSE_ZERO: lambda a: f"({a[0]} != 0.0) ? {a[1]} : 0.0",
}


def c_literal(value: float) -> str:
    """A C literal that reads back as the same double.

    Raises
    ------
    NotImplementedError : the constant is not finite.
    """
    if not math.isfinite(value):
        raise NotImplementedError(f"the constant {value} has no literal in C")
    return repr(float(value))


class CBody:
    """C code for the values of a field; ``sources`` are the C expressions of its inputs, element by element."""

    def __init__(self, order: EvaluationOrder, sources: Sequence[Sequence[str]]) -> None:
        self._plain: dict[int, str] = {}  # inputs and constants, which need no line
        self._lines: dict[int, str] = {}
        for place, value in enumerate(order.values):
            if value.op == ca.OP_CONST:
                self._plain[place] = _literal(value.value)
            elif value.op == ca.OP_INPUT:
                self._plain[place] = sources[value.of[0]][value.of[1]]
            else:
                text = _expression(value.op, [self.text(k) for k in value.of])
                self._lines[place] = f"const double {self.text(place)} = {text};"

    def text(self, place: int) -> str:
        """The C expression of the value at a place: a name, an input or a constant."""
        return self._plain.get(place) or f"v{place}"

    def lines(self, places: Iterable[int]) -> list[str]:
        """The lines that compute the values at these places, in order."""
        return [self._lines[place] for place in sorted(places) if place in self._lines]


def _literal(value: float) -> str:
    return c_literal(value) if not math.copysign(1.0, value) < 0 else f"({c_literal(value)})"


def _expression(op: int, a: Sequence[str]) -> str:
    if op in _INFIX:
        return f"{a[0]} {_INFIX[op]} {a[1]}"
    if op in _COMPARISONS:
        return f"({a[0]} {_COMPARISONS[op]} {a[1]}) ? 1.0 : 0.0"
    if op in _FUNCTIONS:
        return f"{_FUNCTIONS[op]}({', '.join(a)})"
    if op in _OTHERS:
        return _OTHERS[op](a)
    raise NotImplementedError(f"operation {op} of the graph has no C code")
