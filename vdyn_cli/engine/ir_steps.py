"""The loop over Runge-Kutta steps as LLVM IR, the same for every model.

A step computes the values of all its stages first, which keeps what their tangents need on a tape; then the tangents of
one group of directions after another, each of which stays in the first-level cache meanwhile. The step length has no
derivative, so tangents are integrated like values. Data stored as one vector is loaded as one vector, because a load
that spans two stores has to wait for memory.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

UNROLLED = 4  # so many vectors are unrolled, not looped over
# Of each stage: the rates k and the length h of z + h k, the inputs, and the rates that it computes.
STAGES = (
    ("still", "0.0", "before", "k1"),
    ("k1", "%half", "middle", "k2"),
    ("k2", "%half", "middle", "k3"),
    ("k3", "%h", "after", "k4"),
)
_RATES = ("still", "k1", "k2", "k3", "k4")
_ARRAYS = "ptr %z, ptr %u, ptr %dt, ptr %p, ptr %tp, ptr %w, ptr %trajectory"
_LENGTHS = "double %h, double %half, double %sixth"


@dataclass(frozen=True)
class KernelSizes:
    """Numbers of elements in the arrays of a kernel.

    Parameters
    ----------
    states, inputs, constants, readings : of the graph. width : tangent directions of a group; 0: values only.
    held : values that ``prepare`` stores. tape : factors that the tangents of a stage need.
    """

    states: int
    inputs: int
    constants: int
    readings: int
    width: int
    held: int
    tape: int

    @property
    def stages(self) -> tuple[tuple[str, str, str, str], ...]:
        """The stages of a step; for a model without states its readings only."""
        return STAGES if self.states else STAGES[:1]


def print_steps(s: KernelSizes) -> list[str]:
    """``void run(n, every, groups, z, u, dt, p, tp, w, trajectory)``, arrays as in kernel.py.

    It calls ``prepare(p, q, tape)`` once, which stores in q the values that depend on constants only; then ``field(z,
    k, h, u, p, q, f, w, tape, reading)``: rates f and, on request, readings w of the state z + h k. For the tangents of
    each group, ``prepare_tangents(tp, q, tape)`` and ``tangents(z, k, h, tp, q, f, w, tape, reading)`` follow them.
    """
    local = dict.fromkeys(("now", *_RATES), s.states) | {"middle": s.inputs, "q": s.held}
    return [
        *_functions("", 1, s.states),
        *_function("halfway", "out left right", "", (1, s.inputs), _mean),
        *(_tangent_functions(s) if s.width else []),
        f"define void @run(i64 %n, i64 %every, i64 %groups, {_ARRAYS}) #0 {{",
        "entry:",
        *_allocated({**local, "tapes": s.tape * len(s.stages)}),
        *(f"%size_{name} = mul i64 %groups, {s.width * size}" for name, size in _per_group(s).items()),
        *(f"%t_{name} = alloca double, i64 %size_{name}, align 64" for name in ("z", "q")),
        f"%row = add i64 %size_w, {s.readings}",
        "%start = getelementptr double, ptr %z, i64 %size_z",
        "call void @copy(ptr %now, ptr %start)",
        "call void @clear(ptr %still)",
        "call void @prepare(ptr %p, ptr %q, ptr %tapes)",
        *(["call void @begin(i64 %groups, ptr %t_z, ptr %z, ptr %tp, ptr %t_q, ptr %tapes)"] if s.width else []),
        *_loop("%n", *_step(s)),
        "call void @copy(ptr %start, ptr %now)",
        *(["call void @end(i64 %groups, ptr %z, ptr %t_z)"] if s.width else []),
        "ret void",
        "}",
    ]


def _per_group(s: KernelSizes) -> dict[str, int]:
    return {"z": s.states, "q": s.held, "w": s.readings}


def _step(s: KernelSizes) -> list[str]:
    """One step: values, then the tangents of all groups."""
    lines = [
        *_address("before", "u", s.inputs),
        *_address("length", "dt", 1),
        *_address("kept", "trajectory", s.states),
        *_address("seen", "w", "%row"),
        f"%after = getelementptr double, ptr %before, i64 {s.inputs}",
        "%read = getelementptr double, ptr %seen, i64 %size_w",
        "%h = load double, ptr %length, align 8",
        "%half = fdiv double %h, 2.0",
        "%sixth = fdiv double %h, 6.0",
        "%since = urem i64 %at, %every",
        "%reading = icmp eq i64 %since, 0",
        "call void @copy(ptr %kept, ptr %now)",
        "call void @halfway(ptr %middle, ptr %before, ptr %after)",
    ]
    for at, (k, h, u, rates) in enumerate(s.stages):
        arrays = f"ptr %{u}, ptr %p, ptr %q, ptr %{rates}, ptr %read, ptr %tape{at}, i1 {_reading(at)}"
        lines += [f"%tape{at} = getelementptr double, ptr %tapes, i64 {at * s.tape}"]
        lines += [f"call void @field(ptr %now, ptr %{k}, double {h}, {arrays})"]
    lines += ["call void @finish(ptr %now, ptr %k1, ptr %k2, ptr %k3, ptr %k4, double %sixth)"]
    arrays = f"i64 %groups, ptr %t_z, ptr %tp, ptr %t_q, ptr %seen, ptr %tapes, i1 %reading, {_LENGTHS}"
    return [*lines, f"call void @step({arrays})"] if s.width else lines


def _reading(stage: int) -> str:
    """Whether a stage computes the readings: the first of a step that begins at a sample."""
    return "false" if stage else "%reading"


def _tangent_functions(s: KernelSizes) -> list[str]:
    """``begin``, ``step`` and ``end``: loops over the groups of directions."""
    z = _address("now", "z", s.states * s.width)
    others = _address("ours", "tp", s.constants * s.width) + _address("held", "q", s.held * s.width)
    step = [*z, *others, *_address("seen", "w", s.readings * s.width)]
    for at, (k, h, _, rates) in enumerate(s.stages):
        arrays = f"ptr %ours, ptr %held, ptr %{rates}, ptr %seen, ptr %tape{at}, i1 {_reading(at)}"
        step += [f"%tape{at} = getelementptr double, ptr %tape, i64 {at * s.tape}"]
        step += [f"call void @tangents(ptr %now, ptr %{k}, double {h}, {arrays})"]
    step += ["call void @d_finish(ptr %now, ptr %k1, ptr %k2, ptr %k3, ptr %k4, double %sixth)"]
    copy = [*z, *_address("there", "from", s.states * s.width), "call void @d_copy(ptr %now, ptr %there)"]
    prepare = [*others, "call void @prepare_tangents(ptr %ours, ptr %held, ptr %tape)"]
    locals_of_step = [*_allocated(dict.fromkeys(_RATES, s.states * s.width)), "call void @d_clear(ptr %still)"]
    return [
        *_functions("d_", s.width, s.states),
        *_over_groups("begin", "ptr %z, ptr %from, ptr %tp, ptr %q, ptr %tape", [], [*copy, *prepare]),
        *_over_groups(
            "step", f"ptr %z, ptr %tp, ptr %q, ptr %w, ptr %tape, i1 %reading, {_LENGTHS}", locals_of_step, step
        ),
        *_over_groups("end", "ptr %z, ptr %from", [], copy),
    ]


def _over_groups(name: str, arguments: str, before: list[str], lines: list[str]) -> list[str]:
    first = [f"define internal void @{name}(i64 %groups, {arguments}) #0 {{", "entry:"]
    return [*first, *before, *_loop("%groups", *lines), "ret void", "}"]


def _allocated(sizes: dict[str, int]) -> list[str]:
    return [f"%{name} = alloca [{max(size, 1)} x double], align 64" for name, size in sizes.items()]


def _loop(count: str, *lines: str) -> list[str]:
    head = ["br label %body", "body:", "%at = phi i64 [0, %entry], [%next, %body]"]
    tail = ["%next = add i64 %at, 1", f"%done = icmp eq i64 %next, {count}", "br i1 %done, label %over, label %body"]
    return [*head, *lines, *tail, "over:"]


def _address(name: str, array: str, stride: int | str) -> list[str]:
    return [f"%o_{name} = mul i64 %at, {stride}", f"%{name} = getelementptr double, ptr %{array}, i64 %o_{name}"]


def _functions(prefix: str, width: int, states: int) -> list[str]:
    """``copy``, ``clear`` and ``finish`` for the values of all states, or their tangents."""
    whole = width, states
    return [
        *_function(f"{prefix}copy", "out from", "", whole, lambda b: b.store(b.load("from"))),
        *_function(f"{prefix}clear", "out", "", whole, lambda b: b.store(b.all("0.0"))),
        *_function(f"{prefix}finish", "z k1 k2 k3 k4", ", double %h", whole, _finished),
    ]


class _Block:
    """Code for one vector: loads, arithmetic, one store."""

    def __init__(self, tag: str, width: int, index: str) -> None:
        self.lines: list[str] = []
        self._tag, self._index, self._width = tag, index, width
        self._type = f"<{width} x double>"

    def _name(self, text: str) -> str:
        name = f"%{self._tag}_{len(self.lines)}"
        self.lines.append(f"{name} = {text}")
        return name

    def _at(self, array: str) -> str:
        return self._name(f"getelementptr double, ptr %{array}, i64 {self._index}")

    def load(self, array: str) -> str:
        return self._name(f"load {self._type}, ptr {self._at(array)}, align 8")

    def store(self, value: str, array: str = "out") -> None:
        at = self._at(array)
        self.lines.append(f"store {self._type} {value}, ptr {at}, align 8")

    def apply(self, op: str, left: str, right: str) -> str:
        return self._name(f"{op} {self._type} {left}, {right}")

    def all(self, value: str) -> str:
        one = self._name(f"insertelement {self._type} undef, double {value}, i32 0")
        zeros = f"<{self._width} x i32> zeroinitializer"
        return self._name(f"shufflevector {self._type} {one}, {self._type} undef, {zeros}")


def _mean(b: _Block) -> None:
    total = b.apply("fadd", b.load("left"), b.load("right"))
    b.store(b.apply("fdiv", total, b.all("2.0")))


def _finished(b: _Block) -> None:
    """z + h (((k1 + 2 k2) + 2 k3) + k4), in this order, like the virtual machine."""
    total = b.load("k1")
    for name in ("k2", "k3"):
        k = b.load(name)
        total = b.apply("fadd", total, b.apply("fadd", k, k))
    total = b.apply("fadd", total, b.load("k4"))
    b.store(b.apply("fadd", b.load("z"), b.apply("fmul", b.all("%h"), total)), "z")


def _function(name: str, arrays: str, extra: str, size: tuple[int, int], work: Callable[[_Block], None]) -> list[str]:
    """A function that applies ``work`` to all vectors, of which ``size`` is the width and the number."""
    width, count = size
    arguments = ", ".join(f"ptr noalias %{array}" for array in arrays.split())
    lines = [f"define internal void @{name}({arguments}{extra}) #0 {{", "entry:"]
    if count <= UNROLLED:
        for k in range(count):
            block = _Block(f"r{k}", width, str(k * width))
            work(block)
            lines += block.lines
    else:
        block = _Block("b", width, "%i")
        work(block)
        lines += _loop(str(count), f"%i = mul i64 %at, {width}", *block.lines)
    return [*lines, "ret void", "}"]
