"""Printing a graph as LLVM IR: a loop over steps, each value with K tangent lanes beside it.

No fast-math flags and no library knowledge: values come out as CasADi's virtual machine computes them, bit for bit.
"""

from __future__ import annotations

import struct

import casadi as ca

from vdyn_cli.engine.dual import Lanes, Value, instructions, tangent
from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.ir_steps import print_steps

_ARITHMETIC = {ca.OP_ADD: "fadd", ca.OP_SUB: "fsub", ca.OP_MUL: "fmul", ca.OP_DIV: "fdiv"}
_COMPARISONS = {ca.OP_LT: "olt", ca.OP_LE: "ole", ca.OP_EQ: "oeq", ca.OP_NE: "une"}
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
    ca.OP_SQRT: "llvm.sqrt.f64",
    ca.OP_FABS: "llvm.fabs.f64",
    ca.OP_FLOOR: "llvm.floor.f64",
    ca.OP_CEIL: "llvm.ceil.f64",
    ca.OP_FMAX: "llvm.maxnum.f64",
    ca.OP_FMIN: "llvm.minnum.f64",
    ca.OP_COPYSIGN: "llvm.copysign.f64",
}
_BINARY = (ca.OP_ATAN2, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_FMAX, ca.OP_FMIN, ca.OP_COPYSIGN)
# The stack is aligned so that spilled lanes do not straddle cache lines: a third of the time of small models.
_ATTRIBUTES = 'attributes #0 = { nounwind alignstack=64 "no-builtins" }'


def constant(value: float) -> str:
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


class Printer:
    """The algebra that prints: values and lanes are names of the text."""

    def __init__(self, lanes: int) -> None:
        self.lines: list[str] = []
        self.used: set[str] = set()
        self._row = f"<{lanes} x double>"
        self._lanes = lanes
        self._spread: dict[str, str] = {}
        self._count = 0

    def name(self, text: str) -> str:
        """A new name for the result of an instruction."""
        self._count += 1
        self.lines.append(f"%v{self._count} = {text}")
        return f"%v{self._count}"

    def value(self, op: int, *arguments: Value) -> str:
        a = [constant(x) if isinstance(x, float) else x for x in arguments]
        if op in _ARITHMETIC:
            return self.name(f"{_ARITHMETIC[op]} double {a[0]}, {a[1]}")
        if op in _FUNCTIONS:
            self.used.add(f"double @{_FUNCTIONS[op]}({'double, double' if op in _BINARY else 'double'})")
            return self.name(f"call double @{_FUNCTIONS[op]}({', '.join(f'double {x}' for x in a)})")
        if op in _COMPARISONS:
            return self._number(self._compare(_COMPARISONS[op], a[0], a[1]))
        if op == ca.OP_ASSIGN:
            return str(a[0])
        if op == ca.OP_SQ:
            return self.name(f"fmul double {a[0]}, {a[0]}")
        if op == ca.OP_TWICE:
            return self.name(f"fadd double {a[0]}, {a[0]}")
        if op == ca.OP_NEG:
            return self.name(f"fneg double {a[0]}")
        if op == ca.OP_INV:
            return self.name(f"fdiv double {constant(1.0)}, {a[0]}")
        return self._logic(op, a)

    def _logic(self, op: int, a: list[str]) -> str:
        zero = constant(0.0)
        if op == ca.OP_SIGN:
            below = self._compare("olt", a[0], zero)
            above = self._compare("ogt", a[0], zero)
            positive = self.name(f"select i1 {above}, double {constant(1.0)}, double {a[0]}")
            return self.name(f"select i1 {below}, double {constant(-1.0)}, double {positive}")
        first = self._compare("une", a[0], zero)
        if op == ca.OP_IF_ELSE_ZERO:
            return self.name(f"select i1 {first}, double {a[1]}, double {zero}")
        if op == ca.OP_NOT:
            return self._number(self.name(f"xor i1 {first}, true"))
        if op in (ca.OP_AND, ca.OP_OR):
            word = "and" if op == ca.OP_AND else "or"
            return self._number(self.name(f"{word} i1 {first}, {self._compare('une', a[1], zero)}"))
        raise NotImplementedError(f"operation {op} of the graph")

    def _compare(self, how: str, left: str, right: str) -> str:
        return self.name(f"fcmp {how} double {left}, {right}")

    def _number(self, truth: str) -> str:
        return self.name(f"uitofp i1 {truth} to double")

    def scale(self, lanes: Lanes, by: Value) -> str:
        scalar = constant(by) if isinstance(by, float) else by
        if scalar not in self._spread:
            one = self.name(f"insertelement {self._row} undef, double {scalar}, i32 0")
            zeros = f"<{self._lanes} x i32> zeroinitializer"
            self._spread[scalar] = self.name(f"shufflevector {self._row} {one}, {self._row} undef, {zeros}")
        return self.name(f"fmul {self._row} {lanes}, {self._spread[scalar]}")

    def add(self, left: Lanes, right: Lanes) -> str:
        return self.name(f"fadd {self._row} {left}, {right}")

    def subtract(self, left: Lanes, right: Lanes) -> str:
        return self.name(f"fsub {self._row} {left}, {right}")

    def negate(self, lanes: Lanes) -> str:
        return self.name(f"fneg {self._row} {lanes}")

    def choose(self, condition: Value, lanes: Lanes) -> str:
        truth = self._compare("une", condition, constant(0.0))
        return self.name(f"select i1 {truth}, {self._row} {lanes}, {self._row} zeroinitializer")

    def load(self, array: str, offset: int) -> str:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        return self.name(f"load double, ptr {at}, align 8")

    def load_lanes(self, array: str, offset: int) -> str:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        return self.name(f"load {self._row}, ptr {at}, align 8")

    def move(self, value: str, rate: str) -> str:
        """The value at this stage of the step."""
        return self.value(ca.OP_ADD, value, self.value(ca.OP_MUL, "%h", rate))

    def move_lanes(self, offset: int) -> str:
        return self.add(self.load_lanes("%z", offset), self.scale(self.load_lanes("%k", offset), "%h"))

    def store(self, value: str, array: str, offset: int) -> None:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        self.lines.append(f"store double {value}, ptr {at}, align 8")

    def store_lanes(self, lanes: Lanes | None, array: str, offset: int) -> None:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        self.lines.append(f"store {self._row} {lanes or 'zeroinitializer'}, ptr {at}, align 8")


def print_kernel(graph: Graph, lanes: int, live: frozenset[int], seeded: frozenset[int]) -> str:
    """The text of ``void run(i64 n, z, u, dt, p, p_tangents, w, trail)``, arrays as in kernel.py.

    ``live`` states and ``seeded`` constants are those whose tangents can differ from zero.
    """
    states, inputs = int(graph.field.size1_in(0)), int(graph.field.size1_in(1))
    out = _print_field(graph.field, lanes, live, seeded)
    arrays = "ptr %z, ptr %k, double %h, ptr %u, ptr %p, ptr %tp, ptr %f, ptr %w"
    text = [*(f"declare {function}" for function in sorted(out.used))]
    text += [f"define internal void @field({arrays}) #0 {{", *out.lines, "ret void", "}"]
    text += print_steps(states, inputs, graph.readings, lanes)
    return "\n".join([*text, _ATTRIBUTES])


def _print_field(field: ca.Function, lanes: int, live: frozenset[int], seeded: frozenset[int]) -> Printer:
    """The rates f and the readings w of the state z + h k, arranged [lanes | values]."""
    out = Printer(lanes)
    states, readings = int(field.size1_in(0)), int(field.size1_out(1))
    work: dict[int, tuple[str, Lanes | None]] = {}
    for op, to, of, value in instructions(field):
        if op == ca.OP_OUTPUT:
            array, count = (("%f", states), ("%w", readings))[to[0]]
            out.store(work[of[0]][0], array, count * lanes + to[1])
            if lanes:
                out.store_lanes(work[of[0]][1], array, to[1] * lanes)
        elif op == ca.OP_CONST:
            work[to[0]] = constant(value), None
        elif op == ca.OP_INPUT:
            source, i = of
            if source == 0:
                moved = out.move(out.load("%z", states * lanes + i), out.load("%k", states * lanes + i))
                carried = out.move_lanes(i * lanes) if lanes and i in live else None
            else:
                moved = out.load(("%u", "%p")[source - 1], i)
                carried = out.load_lanes("%tp", i * lanes) if lanes and source == 2 and i in seeded else None
            work[to[0]] = moved, carried
        else:
            a, ts = [work[k][0] for k in of], [work[k][1] for k in of]
            v = out.value(op, *a)
            work[to[0]] = v, tangent(out, op, a, v, ts) if lanes else None
    return out
