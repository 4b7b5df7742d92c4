"""The loop over Runge-Kutta steps as LLVM IR, the same for every model.

The step length has no derivative, so tangents are integrated like values, in one row z of both. Rows are arranged
[tangents | values], which keeps tangents aligned; data stored as one vector is loaded as one vector, because a load
that spans two stores has to wait for memory.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence

UNROLLED = 4  # groups of up to so many vectors are unrolled, not looped over

Groups = Sequence[tuple[int, int]]  # (width, count) of consecutive groups of vectors


def print_steps(states: int, inputs: int, readings: int, directions: int, held: int) -> list[str]:
    """``void run(n, z, u, dt, p, tp, w, trajectory)``, arrays as in kernel.py.

    It calls ``prepare(p, tp, q)`` once, which stores in q, of size ``held``, the values that depend on constants only;
    then ``field(z, k, h, u, p, tp, q, f, w, reading)``: rates f and, on request, readings w of the state z + h k.
    """
    if not states:
        return _static(inputs, readings, directions, held)
    row, seen = states * (1 + directions), readings * (1 + directions)
    whole, values = ((directions, states), (1, states)), ((1, states),)
    local = {"now": row, "still": row, "k1": row, "k2": row, "k3": row, "k4": row, "middle": inputs, "q": held}
    return [
        *_function("copy", "out from", "", whole, lambda b: b.store(b.load("from"))),
        *_function("keep", "out from", "", values, lambda b: b.store(b.load("from"))),
        *_function("clear", "out", "", whole, lambda b: b.store(b.all("0.0"))),
        *_function("halfway", "out left right", "", ((1, inputs),), _mean),
        *_function("finish", "z k1 k2 k3 k4", ", double %h", whole, _finished),
        "define void @run(i64 %n, ptr %z, ptr %u, ptr %dt, ptr %p, ptr %tp, ptr %w, ptr %trajectory) #0 {",
        "entry:",
        *(f"%{name} = alloca [{max(size, 1)} x double], align 64" for name, size in local.items()),
        f"%values = getelementptr double, ptr %now, i64 {states * directions}",
        "call void @copy(ptr %now, ptr %z)",
        "call void @clear(ptr %still)",
        "call void @prepare(ptr %p, ptr %tp, ptr %q)",
        *_loop(
            *_address("before", "u", inputs),
            *_address("seen", "w", seen),
            *_address("length", "dt", 1),
            *_address("kept", "trajectory", states),
            f"%after = getelementptr double, ptr %before, i64 {inputs}",
            "%h = load double, ptr %length, align 8",
            "%half = fdiv double %h, 2.0",
            "%sixth = fdiv double %h, 6.0",
            "call void @keep(ptr %kept, ptr %values)",
            "call void @halfway(ptr %middle, ptr %before, ptr %after)",
            _field("still", "0.0", "before", "k1", reading=True),
            _field("k1", "%half", "middle", "k2"),
            _field("k2", "%half", "middle", "k3"),
            _field("k3", "%h", "after", "k4"),
            "call void @finish(ptr %now, ptr %k1, ptr %k2, ptr %k3, ptr %k4, double %sixth)",
        ),
        "call void @copy(ptr %z, ptr %now)",
        "ret void",
        "}",
    ]


def _static(inputs: int, readings: int, directions: int, held: int) -> list[str]:
    """The loop for a model without states: readings only."""
    return [
        "define void @run(i64 %n, ptr %now, ptr %u, ptr %dt, ptr %p, ptr %tp, ptr %w, ptr %trajectory) #0 {",
        "entry:",
        f"%q = alloca [{max(held, 1)} x double], align 64",
        "call void @prepare(ptr %p, ptr %tp, ptr %q)",
        *_loop(
            *_address("before", "u", inputs),
            *_address("seen", "w", readings * (1 + directions)),
            _field("now", "0.0", "before", "now", reading=True),
        ),
        "ret void",
        "}",
    ]


def _field(k: str, h: str, u: str, rates: str, reading: bool = False) -> str:
    arrays = f"ptr %{u}, ptr %p, ptr %tp, ptr %q, ptr %{rates}, ptr %seen, i1 {str(reading).lower()}"
    return f"call void @field(ptr %now, ptr %{k}, double {h}, {arrays})"


def _loop(*lines: str) -> list[str]:
    head = ["br label %body", "body:", "%step = phi i64 [0, %entry], [%next, %body]"]
    tail = ["%next = add i64 %step, 1", "%done = icmp eq i64 %next, %n", "br i1 %done, label %end, label %body", "end:"]
    return [*head, *lines, *tail]


def _address(name: str, array: str, stride: int) -> list[str]:
    return [f"%o_{name} = mul i64 %step, {stride}", f"%{name} = getelementptr double, ptr %{array}, i64 %o_{name}"]


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


def _function(name: str, arrays: str, extra: str, groups: Groups, work: Callable[[_Block], None]) -> list[str]:
    """A function that applies ``work`` to all vectors of all groups."""
    arguments = ", ".join(f"ptr noalias %{array}" for array in arrays.split())
    lines = [f"define internal void @{name}({arguments}{extra}) #0 {{", "entry:"]
    start, here = 0, "entry"
    for width, count in groups:
        stop = start + width * count
        if count <= UNROLLED:
            for offset in range(start, stop, width or 1):
                block = _Block(f"r{offset}", width, str(offset))
                work(block)
                lines += block.lines
        elif width:
            block = _Block(f"b{start}", width, f"%i{start}")
            work(block)
            lines += [f"br label %loop{start}", f"loop{start}:"]
            lines += [f"%i{start} = phi i64 [{start}, %{here}], [%j{start}, %loop{start}]", *block.lines]
            lines += [f"%j{start} = add i64 %i{start}, {width}", f"%e{start} = icmp eq i64 %j{start}, {stop}"]
            lines += [f"br i1 %e{start}, label %done{start}, label %loop{start}", f"done{start}:"]
            here = f"done{start}"
        start = stop
    return [*lines, "ret void", "}"]
