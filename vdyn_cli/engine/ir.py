"""A graph as LLVM IR: a loop over steps, each value with K tangent directions.

Without fast-math flags and built-in knowledge of libm, values equal those of CasADi's virtual machine, bit for bit.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from vdyn_cli.engine.dual import Tangents, Value, tangent
from vdyn_cli.engine.evaluation_order import EvaluationOrder, ordered
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
ROW = 8  # tangents per vector instruction, roughly
# Stack alignment keeps spilled tangents within cache lines: saves a third of the time of small models.
_ATTRIBUTES = 'attributes #0 = { nounwind alignstack=64 "no-builtins" }'


def constant(value: float) -> str:
    """A literal of LLVM IR that is exactly this double: its bits in hexadecimal."""
    return f"0x{struct.unpack('<Q', struct.pack('<d', value))[0]:016X}"


@dataclass(frozen=True)
class _Term:
    """A row of tangents times a factor, both by name; a factor of None is 1."""

    row: str
    factor: str | None
    minus: bool


class _ValuePrinter:
    """Prints the operations on values; a value is a name in the text."""

    def __init__(self) -> None:
        self.lines: list[str] = []
        self.used: set[str] = set()
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

    def load(self, array: str, offset: int) -> str:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        return self.name(f"load double, ptr {at}, align 8")

    def move(self, value: str, rate: str) -> str:
        """value + h rate, at this stage of the step."""
        return self.value(ca.OP_ADD, value, self.value(ca.OP_MUL, "%h", rate))

    def store(self, value: str, array: str, offset: int) -> None:
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        self.lines.append(f"store double {value}, ptr {at}, align 8")


class Printer(_ValuePrinter):
    """The algebra that prints: values are names in the text, tangents are lists of terms not summed yet."""

    def __init__(self, directions: int) -> None:
        super().__init__()
        self._row = f"<{directions} x double>"
        self._directions = directions
        self._spread: dict[str, str] = {}

    def scale(self, tangents: Tangents, by: Value) -> Tangents:
        """The tangents times a value; a few terms are scaled one by one (scalars, not rows), many are summed first."""
        scalar = constant(by) if isinstance(by, float) else by
        few = tangents if len(tangents) <= max(1, self._directions // ROW) else self.collected(tangents)
        return tuple(
            _Term(t.row, scalar if t.factor is None else self.name(f"fmul double {t.factor}, {scalar}"), t.minus)
            for t in few
        )

    def add(self, left: Tangents, right: Tangents) -> Tangents:
        """The sum: terms of the same row are merged, the others are kept until the sum is needed."""
        terms = {t.row: t for t in left}
        for t in right:
            terms[t.row] = self._merged(terms[t.row], t) if t.row in terms else t
        return tuple(terms.values())

    def _merged(self, a: _Term, b: _Term) -> _Term:
        """Two terms of the same row as one."""
        one = constant(1.0)
        how = "fadd" if a.minus == b.minus else "fsub"
        return _Term(a.row, self.name(f"{how} double {a.factor or one}, {b.factor or one}"), a.minus)

    def subtract(self, left: Tangents, right: Tangents) -> Tangents:
        """The left tangents minus the right ones."""
        return self.add(left, self.negate(right))

    def negate(self, tangents: Tangents) -> Tangents:
        """The tangents times -1: changes the signs of the terms, without an instruction."""
        return tuple(_Term(t.row, t.factor, not t.minus) for t in tangents)

    def choose(self, condition: Value, tangents: Tangents) -> Tangents:
        """The tangents where the condition is not 0, else 0."""
        truth = self._compare("une", condition, constant(0.0))
        return self._single(
            self.name(f"select i1 {truth}, {self._row} {self.sum(tangents)}, {self._row} zeroinitializer")
        )

    def collected(self, tangents: Tangents) -> Tangents:
        """The tangents summed to one term."""
        return tangents if len(tangents) == 1 else self._single(self.sum(tangents))

    def sum(self, tangents: Tangents) -> str:
        """Name of the row that is the sum of the terms."""
        total = ""
        for term in tangents:
            row = term.row if term.factor is None else self._times(term.row, term.factor)
            if total:
                total = self.name(f"{'fsub' if term.minus else 'fadd'} {self._row} {total}, {row}")
            else:
                total = self.name(f"fneg {self._row} {row}") if term.minus else row
        return total

    def _single(self, row: str) -> Tangents:
        return (_Term(row, None, False),)

    def _times(self, row: str, scalar: str) -> str:
        if scalar not in self._spread:
            one = self.name(f"insertelement {self._row} undef, double {scalar}, i32 0")
            zeros = f"<{self._directions} x i32> zeroinitializer"
            self._spread[scalar] = self.name(f"shufflevector {self._row} {one}, {self._row} undef, {zeros}")
        return self.name(f"fmul {self._row} {row}, {self._spread[scalar]}")

    def load_tangents(self, array: str, offset: int) -> Tangents:
        """The row of K derivatives in an array at an offset, in doubles."""
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        return self._single(self.name(f"load {self._row}, ptr {at}, align 8"))

    def move_tangents(self, offset: int) -> Tangents:
        """Tangents of z + h k of one state."""
        moved = self.add(self.load_tangents("%z", offset), self.scale(self.load_tangents("%k", offset), "%h"))
        return self.collected(moved)

    def store_tangents(self, tangents: Tangents | None, array: str, offset: int) -> None:
        """Write the row of K derivatives into an array at an offset; None is zero."""
        at = self.name(f"getelementptr double, ptr {array}, i64 {offset}")
        row = "zeroinitializer" if tangents is None else self.sum(tangents)
        self.lines.append(f"store {self._row} {row}, ptr {at}, align 8")


@lru_cache(maxsize=64)
def print_kernel(graph: Graph, directions: int, live: frozenset[int], seeded: frozenset[int]) -> str:
    """The text of ``void run(i64 n, z, u, dt, p, p_tangents, w, trajectory)``, arrays as in kernel.py.

    ``directions`` is K, the number of tangent directions; ``live`` and ``seeded`` are the indices of the states and
    constants whose tangents can be nonzero.
    """
    states, inputs = int(graph.field.size1_in(0)), int(graph.field.size1_in(1))
    body = _Body(ordered(graph.field), directions, live, seeded, states, graph.readings)
    first, out = body.prepared(), body.field()
    arrays = "ptr %z, ptr %k, double %h, ptr %u, ptr %p, ptr %tp, ptr %q, ptr %f, ptr %w, i1 %reading"
    text = [*(f"declare {function}" for function in sorted(first.used | out.used))]
    text += ["define internal void @prepare(ptr %p, ptr %tp, ptr %q) #0 {", *first.lines, "ret void", "}"]
    text += [f"define internal void @field({arrays}) #0 {{", *out.lines, "ret void", "}"]
    text += print_steps(states, inputs, graph.readings, directions, body.held * (1 + directions))
    return "\n".join([*text, _ATTRIBUTES])


class _Body:
    """A field in two functions: ``prepare`` stores the values that depend on constants only, ``field`` does the rest.

    Rates f and readings w are those of the state z + h k; rows are arranged [tangents | values]. Values needed for
    readings only are skipped in the stages without readings.
    """

    def __init__(
        self,
        order: EvaluationOrder,
        directions: int,
        live: frozenset[int],
        seeded: frozenset[int],
        states: int,
        readings: int,
    ) -> None:
        self._order, self._directions, self._live, self._seeded = order, directions, live, seeded
        self._states, self._readings = states, readings
        self._kept = {place: row for row, place in enumerate(order.kept)}
        self._tangents: dict[int, bool] = {}

    @property
    def held(self) -> int:
        """Number of values that ``prepare`` stores."""
        return len(self._kept)

    def prepared(self) -> Printer:
        out = Printer(self._directions)
        work = self._computed(out, self._order.once, {})
        for place, row in self._kept.items():
            value, carried = work[place]
            self._tangents[place] = carried is not None
            out.store(value, "%q", self.held * self._directions + row)
            if carried is not None:
                out.store_tangents(carried, "%q", row * self._directions)
        return out

    def field(self) -> Printer:
        out, order = Printer(self._directions), self._order
        work = self._computed(out, order.moving, {})
        self._store(out, work, order.rates, "%f", self._states)
        out.lines += ["br i1 %reading, label %read, label %done", "read:"]
        self._store(out, self._computed(out, order.reading, work), order.readings, "%w", self._readings)
        out.lines += ["br label %done", "done:"]
        return out

    def _store(self, out: Printer, work: _Work, places: Sequence[int], array: str, count: int) -> None:
        for i, place in enumerate(places):
            value, carried = self._found(out, work, place)
            out.store(value, array, count * self._directions + i)
            if self._directions:
                out.store_tangents(carried, array, i * self._directions)

    def _computed(self, out: Printer, places: Sequence[int], work: _Work) -> _Work:
        for place in places:
            op, of, value = (now := self._order.values[place]).op, now.of, now.value
            if op == ca.OP_CONST:
                work[place] = constant(value), None
            elif op == ca.OP_INPUT:
                work[place] = self._input(out, *of)
            else:
                found = [self._found(out, work, k) for k in of]
                a, t = [v for v, _ in found], [carried for _, carried in found]
                v = out.value(op, *a)
                carried = tangent(out, op, a, v, t) if self._directions else None
                # Tangents that are used several times are summed once.
                shared = carried is not None and self._order.uses[place] > 1
                work[place] = v, out.collected(carried) if shared else carried
        return work

    def _found(self, out: Printer, work: _Work, place: int) -> tuple[str, Tangents | None]:
        """A value, loaded where ``prepare`` has stored it."""
        if place not in work:
            row = self._kept[place]
            carried = out.load_tangents("%q", row * self._directions) if self._tangents[place] else None
            work[place] = out.load("%q", self.held * self._directions + row), carried
        return work[place]

    def _input(self, out: Printer, source: int, i: int) -> tuple[str, Tangents | None]:
        directions = self._directions
        if source == 0:
            moved = out.move(
                out.load("%z", self._states * directions + i), out.load("%k", self._states * directions + i)
            )
            return moved, out.move_tangents(i * directions) if directions and i in self._live else None
        carried = out.load_tangents("%tp", i * directions) if directions and source == 2 and i in self._seeded else None
        return out.load(("%u", "%p")[source - 1], i), carried


_Work = dict[int, tuple[str, Tangents | None]]
