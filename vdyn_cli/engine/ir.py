"""A graph as LLVM IR: a loop over steps, each value with groups of tangent directions.

Without fast-math flags and built-in knowledge of libm, values equal those of CasADi's virtual machine, bit for bit.
"""

from __future__ import annotations

import struct
from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import casadi as ca

from vdyn_cli.engine.dual import Tangents, Value, tangent
from vdyn_cli.engine.evaluation_order import LIBM, EvaluationOrder, ordered
from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.ir_steps import KernelSizes, print_steps

_ARITHMETIC = {ca.OP_ADD: "fadd", ca.OP_SUB: "fsub", ca.OP_MUL: "fmul", ca.OP_DIV: "fdiv"}
_COMPARISONS = {ca.OP_LT: "olt", ca.OP_LE: "ole", ca.OP_EQ: "oeq", ca.OP_NE: "une"}
_FUNCTIONS = {
    **LIBM,
    ca.OP_SQRT: "llvm.sqrt.f64",
    ca.OP_FABS: "llvm.fabs.f64",
    ca.OP_FLOOR: "llvm.floor.f64",
    ca.OP_CEIL: "llvm.ceil.f64",
    ca.OP_FMAX: "llvm.maxnum.f64",
    ca.OP_FMIN: "llvm.minnum.f64",
    ca.OP_COPYSIGN: "llvm.copysign.f64",
}
_BINARY = (ca.OP_ATAN2, ca.OP_POW, ca.OP_CONSTPOW, ca.OP_FMAX, ca.OP_FMIN, ca.OP_COPYSIGN)
_STATE, _RESULTS = "ptr %z, ptr %k, double %h", "ptr %f, ptr %w"
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
        self._names: dict[str, str] = {}

    def name(self, text: str) -> str:
        """The name of the result of an instruction, which is printed once: all arrays that are read are constant."""
        if text not in self._names:
            self._count += 1
            self._names[text] = f"%v{self._count}"
            self.lines.append(f"{self._names[text]} = {text}")
        return self._names[text]

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
    """The algebra that prints: values are names in the text, tangents are lists of terms not summed yet.

    Values and tangents are printed apart, into ``lines`` and ``rows``, because the values are computed once for all
    groups of directions. The factors of terms pass from one to the other on a *tape*, in the order of ``tape``.
    """

    def __init__(self, width: int) -> None:
        super().__init__()
        self.rows: list[str] = []
        self._type = f"<{width} x double>"
        self._zeros = f"<{width} x i32> zeroinitializer"
        self._fused = f"llvm.fmuladd.v{width}f64"
        self.tape: dict[str, int] = {}

    def scale(self, tangents: Tangents, by: Value) -> Tangents:
        """The tangents, summed to one term, times a value: only the factor is computed."""
        scalar = constant(by) if isinstance(by, float) else by
        (one,) = self.collected(tangents)
        factor = scalar if one.factor is None else self.name(f"fmul double {one.factor}, {scalar}")
        return (_Term(one.row, factor, one.minus),)

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
        truth = self._row(f"fcmp une double {self._from_tape(condition)}, {constant(0.0)}")
        row = f"select i1 {truth}, {self._type} {self.sum(tangents)}, {self._type} zeroinitializer"
        return _single(self._row(row))

    def collected(self, tangents: Tangents) -> Tangents:
        """The tangents summed to one term."""
        return tangents if len(tangents) == 1 else _single(self.sum(tangents))

    def sum(self, tangents: Tangents) -> str:
        """Name of the row that is the sum of the terms; processors that can do so add a product in one instruction."""
        first, *others = tangents
        total = first.row if first.factor is None else self._row(f"fmul {self._type} {first.row}, {self._all(first)}")
        total = self._row(f"fneg {self._type} {total}") if first.minus else total
        for term in others:
            if term.factor is None:
                total = self._row(f"{'fsub' if term.minus else 'fadd'} {self._type} {total}, {term.row}")
                continue
            factor = self._all(term)
            factor = self._row(f"fneg {self._type} {factor}") if term.minus else factor
            three = ", ".join(f"{self._type} {row}" for row in (term.row, factor, total))
            total = self._row(f"call {self._type} @{self._fused}({three})")
            self.used.add(f"{self._type} @{self._fused}({', '.join([self._type] * 3)})")
        return total

    def _row(self, text: str) -> str:
        """A new name for the result of an instruction on tangents."""
        self._count += 1
        self.rows.append(f"%r{self._count} = {text}")
        return f"%r{self._count}"

    def _all(self, term: _Term) -> str:
        """The row whose elements are all the factor of a term."""
        assert term.factor is not None
        one = self._row(f"insertelement {self._type} undef, double {self._from_tape(term.factor)}, i32 0")
        return self._row(f"shufflevector {self._type} {one}, {self._type} undef, {self._zeros}")

    def _from_tape(self, scalar: str) -> str:
        """A value, loaded from the tape; a literal and the step ``%h`` as they are."""
        if not scalar.startswith("%v"):
            return scalar
        if scalar not in self.tape:
            self.tape[scalar] = len(self.tape)
            self.store(scalar, "%tape", self.tape[scalar])
        at = self._row(f"getelementptr double, ptr %tape, i64 {self.tape[scalar]}")
        return self._row(f"load double, ptr {at}, align 8")

    def load_tangents(self, array: str, offset: int) -> Tangents:
        """The row of derivatives in an array at an offset, in doubles."""
        at = self._row(f"getelementptr double, ptr {array}, i64 {offset}")
        return _single(self._row(f"load {self._type}, ptr {at}, align 8"))

    def move_tangents(self, offset: int) -> Tangents:
        """Tangents of z + h k of one state."""
        moved = self.add(self.load_tangents("%z", offset), self.scale(self.load_tangents("%k", offset), "%h"))
        return self.collected(moved)

    def store_tangents(self, tangents: Tangents | None, array: str, offset: int) -> None:
        """Write the row of derivatives into an array at an offset; None is zero."""
        row = "zeroinitializer" if tangents is None else self.sum(tangents)
        at = self._row(f"getelementptr double, ptr {array}, i64 {offset}")
        self.rows.append(f"store {self._type} {row}, ptr {at}, align 8")


def _single(row: str) -> Tangents:
    return (_Term(row, None, False),)


@lru_cache(maxsize=64)
def print_kernel(graph: Graph, width: int, live: frozenset[int], seeded: frozenset[int]) -> str:
    """The text of ``void run(n, every, groups, z, u, dt, p, p_tangents, w, trajectory)``, arrays as in kernel.py.

    ``width`` is the number of tangent directions of a group; ``live`` and ``seeded`` are the indices of the states and
    constants whose tangents can be nonzero.
    """
    states, inputs = int(graph.field.size1_in(0)), int(graph.field.size1_in(1))
    body = _Body(ordered(graph.field), width, live, seeded)
    first, out = body.prepared(), body.field()
    text = [*(f"declare {function}" for function in sorted(first.used | out.used))]
    text += _function("prepare", "ptr %p, ptr %q, ptr %tape", first.lines)
    text += _function("field", f"{_STATE}, ptr %u, ptr %p, ptr %q, {_RESULTS}, ptr %tape, i1 %reading", out.lines)
    if width:
        text += _function("prepare_tangents", "ptr %tp, ptr %q, ptr noalias %tape", first.rows)
        arrays = f"{_STATE}, ptr %tp, ptr %q, {_RESULTS}, ptr noalias %tape, i1 %reading"
        text += _function("tangents", arrays, out.rows)
    tape = max(len(first.tape), len(out.tape))
    sizes = KernelSizes(states, inputs, len(graph.constants), graph.readings, width, body.held, tape)
    return "\n".join([*text, *print_steps(sizes), _ATTRIBUTES])


def _function(name: str, arguments: str, lines: Sequence[str]) -> list[str]:
    return [f"define internal void @{name}({arguments}) #0 {{", *lines, "ret void", "}"]


class _Body:
    """A field in two functions: ``prepare`` stores the values that depend on constants only, ``field`` does the rest.

    Rates f and readings w are those of the state z + h k. Values needed for readings only are skipped in the stages
    without readings. Each function has a second part, which computes the tangents of one group of directions.
    """

    def __init__(self, order: EvaluationOrder, width: int, live: frozenset[int], seeded: frozenset[int]) -> None:
        self._order, self._width, self._live, self._seeded = order, width, live, seeded
        self._kept = {place: row for row, place in enumerate(order.kept)}
        self._tangents: dict[int, bool] = {}

    @property
    def held(self) -> int:
        """Number of values that ``prepare`` stores."""
        return len(self._kept)

    def prepared(self) -> Printer:
        out = Printer(self._width)
        work = self._computed(out, self._order.once, {})
        for place, row in self._kept.items():
            value, carried = work[place]
            self._tangents[place] = carried is not None
            out.store(value, "%q", row)
            if carried is not None:
                out.store_tangents(carried, "%q", row * self._width)
        return out

    def field(self) -> Printer:
        out, order = Printer(self._width), self._order
        work = self._computed(out, order.moving, {})
        self._store(out, work, order.rates, "%f")
        for lines in (out.lines, out.rows):
            lines += ["br i1 %reading, label %read, label %done", "read:"]
        self._store(out, self._computed(out, order.reading, work), order.readings, "%w")
        for lines in (out.lines, out.rows):
            lines += ["br label %done", "done:"]
        return out

    def _store(self, out: Printer, work: _Work, places: Sequence[int], array: str) -> None:
        for i, place in enumerate(places):
            value, carried = self._found(out, work, place)
            out.store(value, array, i)
            if self._width:
                out.store_tangents(carried, array, i * self._width)

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
                carried = tangent(out, op, a, v, t) if self._width else None
                # Tangents that are used several times are summed once.
                shared = carried is not None and self._order.uses[place] > 1
                work[place] = v, out.collected(carried) if shared else carried
        return work

    def _found(self, out: Printer, work: _Work, place: int) -> tuple[str, Tangents | None]:
        """A value, loaded where ``prepare`` has stored it."""
        if place not in work:
            row = self._kept[place]
            carried = out.load_tangents("%q", row * self._width) if self._tangents[place] else None
            work[place] = out.load("%q", row), carried
        return work[place]

    def _input(self, out: Printer, source: int, i: int) -> tuple[str, Tangents | None]:
        width = self._width
        if source == 0:
            moved = out.move(out.load("%z", i), out.load("%k", i))
            return moved, out.move_tangents(i * width) if width and i in self._live else None
        carried = out.load_tangents("%tp", i * width) if width and source == 2 and i in self._seeded else None
        return out.load(("%u", "%p")[source - 1], i), carried


_Work = dict[int, tuple[str, Tangents | None]]
