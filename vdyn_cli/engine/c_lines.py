"""The instructions of a graph as lines of C, each result with a name of its own."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence

import casadi as ca

from vdyn_cli.engine.dual import instructions

_INFIX = {ca.OP_ADD: "+", ca.OP_SUB: "-", ca.OP_MUL: "*", ca.OP_DIV: "/"}
_COMPARISONS = {ca.OP_LT: "<", ca.OP_LE: "<=", ca.OP_EQ: "==", ca.OP_NE: "!="}
_FUNCTIONS = {
    ca.OP_SIN: "sin",
    ca.OP_COS: "cos",
    ca.OP_TAN: "tan",
    ca.OP_ASIN: "asin",
    ca.OP_ACOS: "acos",
    ca.OP_ATAN: "atan",
    ca.OP_ATAN2: "atan2",
    ca.OP_TANH: "tanh",
    ca.OP_EXP: "exp",
    ca.OP_LOG: "log",
    ca.OP_POW: "pow",
    ca.OP_CONSTPOW: "pow",
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


def number(value: float) -> str:
    """A C literal that reads back as the same double."""
    if not math.isfinite(value):
        raise NotImplementedError(f"the constant {value} has no literal in C")
    return repr(float(value))


class Body:
    """The instructions of a graph; ``sources`` are the texts of its inputs, element by element."""

    def __init__(self, function: ca.Function, sources: Sequence[Sequence[str]]) -> None:
        self._texts: list[str] = []
        self._of: list[tuple[int, ...]] = []
        self._plain: set[int] = set()
        self._stores: dict[int, dict[int, int]] = {}
        work: dict[int, int] = {}
        for op, to, of, constant in instructions(function):
            if op == ca.OP_OUTPUT:
                self._stores.setdefault(to[0], {})[to[1]] = work[of[0]]
                continue
            place = len(self._texts)
            if op in (ca.OP_CONST, ca.OP_INPUT):
                self._plain.add(place)
                self._texts.append(_literal(constant) if op == ca.OP_CONST else sources[of[0]][of[1]])
                self._of.append(())
            else:
                arguments = tuple(work[k] for k in of)
                self._texts.append(_expression(op, [self.text(k) for k in arguments]))
                self._of.append(arguments)
            work[to[0]] = place

    def stores(self, output: int) -> list[int]:
        """What is stored, in the order of the output's elements."""
        stored = self._stores.get(output, {})
        return [stored[i] for i in range(len(stored))]

    def needed(self, places: Iterable[int]) -> set[int]:
        """The results, inputs and constants aside, on which some results depend, themselves among them."""
        found: set[int] = set()
        waiting = list(places)
        while waiting:
            place = waiting.pop()
            if place not in found and place not in self._plain:
                found.add(place)
                waiting.extend(self._of[place])
        return found

    def text(self, place: int) -> str:
        return self._texts[place] if place in self._plain else f"v{place}"

    def line(self, place: int) -> str:
        return f"const double v{place} = {self._texts[place]};"


def _literal(value: float) -> str:
    return number(value) if not math.copysign(1.0, value) < 0 else f"({number(value)})"


def _expression(op: int, a: Sequence[str]) -> str:
    if op in _INFIX:
        return f"{a[0]} {_INFIX[op]} {a[1]}"
    if op in _COMPARISONS:
        return f"({a[0]} {_COMPARISONS[op]} {a[1]}) ? 1.0 : 0.0"
    if op in _FUNCTIONS:
        return f"{_FUNCTIONS[op]}({', '.join(a)})"
    if op in _OTHERS:
        return _OTHERS[op](a)
    raise NotImplementedError(f"operation {op} of the graph has no line of C")
