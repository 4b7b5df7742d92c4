"""A graph as C99 source: a header and a source file that depend on libm only.

Every instruction becomes one line, with structs of named fields, and the Runge-Kutta step has the same operations as in
ir_steps.py: a compiler that follows ISO C without contraction (``-std=c99``) reproduces the virtual machine to the bit.
"""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import casadi as ca

from vdyn_cli.engine.c_lines import CBody, c_literal
from vdyn_cli.engine.evaluation_order import ordered
from vdyn_cli.engine.graph import Graph, column, refuse_unknown, symbols

_NOTHING: Mapping[str, str] = MappingProxyType({})
_UNSET: Mapping[str, float] = MappingProxyType({})

_KEYWORDS = """
auto break case char const continue default do double else enum extern float for goto if inline int long register
restrict return short signed sizeof static struct switch typedef union unsigned void volatile while
"""


@dataclass(frozen=True)
class CProgram:
    """A model in C.

    Parameters
    ----------
    name : prefix of every name in the files.
    header, source : the text of ``<name>.h`` and ``<name>.c``.
    states, inputs, parameters, outputs : fields of the structs ``<name>_state`` and so on, in order; all are doubles,
        with the graph's names converted to identifiers.
    """

    name: str
    header: str
    source: str
    states: tuple[str, ...]
    inputs: tuple[str, ...]
    parameters: tuple[str, ...]
    outputs: tuple[str, ...]

    @property
    def text(self) -> str:
        """Header and source as one translation unit."""
        return self.header + self.source.replace(f'#include "{self.name}.h"\n', "")


# Seven arguments: graph and substeps fix the program, the others, by keyword, only name and annotate it.
def c_program(
    graph: Graph,
    substeps: int = 1,
    name: str = "model",
    *,
    start: Sequence[str] = (),
    defaults: Mapping[str, float] = _UNSET,
    comments: Mapping[str, str] = _NOTHING,
    title: str = "",
) -> CProgram:
    """Print a graph as C99.

    ::

        void <name>_init(state *x, const input *u, const parameters *p, double <start>...)
        void <name>_step(state *x, const input *before, const input *after, double dt, const parameters *p, output *y)
        void <name>_read(const state *x, const input *u, const parameters *p, output *y)
        extern const parameters <name>_defaults

    A step takes ``substeps`` Runge-Kutta steps of dt / substeps each, with inputs linear from ``before`` to ``after``;
    ``y`` holds the sensors' readings before the step.

    Parameters
    ----------
    start : states whose initial value is an argument of init, such as the speed; the others have the model's start.
    defaults : values of the parameters, SI; 0 where none is given.
    comments : unit and meaning by name.
    title : first line of both files, as a comment.

    Raises
    ------
    ValueError : a name is not a C identifier or not known; the model has no states; a sensor has a shifted clock,
        which would need past values.
    NotImplementedError : an operation has no equivalent in C.
    """
    if not graph.states:
        raise ValueError("a model without states has no step to print")
    if graph.shifted:
        raise ValueError(f"{', '.join(graph.shifted)}: a model in C cannot have a sensor with a shifted clock")
    refuse_unknown("state", start, graph.states)
    refuse_unknown("parameter", defaults, graph.constants)
    groups = {"state": graph.states, "input": graph.inputs, "parameters": graph.constants, "output": graph.outputs}
    names = {group: _identifiers(fields) for group, fields in groups.items()}
    printer = _Printer(name, names, tuple(_identifiers(start)), substeps)
    title = plain(title or f"The model {name}.")
    header = printer.header(groups, comments, title)
    values = {**dict.fromkeys(graph.constants, 0.0), **graph.defaults, **defaults}
    source = printer.source(graph, [values[c] for c in graph.constants], start, title)
    s, u, p, y = (tuple(names[group]) for group in groups)
    return CProgram(name, header, source, s, u, p, y)


def _identifiers(names: Iterable[str]) -> list[str]:
    made = [re.sub(r"\W", "_", name) for name in names]
    for name in made:
        if name in _KEYWORDS.split() or not re.fullmatch(r"[A-Za-z_]\w*", name) or made.count(name) > 1:
            raise ValueError(f"{name!r} cannot be a name in C")
    return made


@dataclass(frozen=True)
class _Printer:
    name: str
    fields: Mapping[str, Sequence[str]]
    start: tuple[str, ...]
    substeps: int

    def header(self, groups: Mapping[str, Sequence[str]], comments: Mapping[str, str], title: str) -> str:
        guard, name = f"{self.name.upper()}_H", self.name
        headings = {"state": "States.", "input": "Inputs.", "parameters": "Parameters.", "output": "Outputs."}
        lines = [f"/* {title} */", f"#ifndef {guard}", f"#define {guard}", ""]
        lines += ["#ifdef __cplusplus", 'extern "C" {', "#endif", ""]
        for group, originals in groups.items():
            lines += [f"/* {headings[group]} */", "typedef struct {"]
            for original, own in zip(originals, self.fields[group], strict=True):
                comment = comments.get(original, "")
                lines.append(f"    double {own};" + (f" /* {plain(comment)} */" if comment else ""))
            lines += [*(["    double nothing;"] if not originals else []), f"}} {name}_{group};", ""]
        lines += [
            "/* Estimated parameters. */",
            f"extern const {name}_parameters {name}_defaults;",
            "",
            "/* Set the initial state" + (f" for the given {', '.join(self.start)}. */" if self.start else ". */"),
            f"{self._init()};",
            "",
            f"/* One step of dt seconds ({self.substeps} Runge-Kutta steps), with inputs linear from before to after.",
            "   y: outputs before the step. */",
            f"{self._step()};",
            "",
            "/* Outputs at the current state. */",
            f"{self._read()};",
            *["", "#ifdef __cplusplus", "}", "#endif", "", f"#endif /* {guard} */", ""],
        ]
        return "\n".join(lines)

    def source(self, graph: Graph, defaults: Sequence[float], start: Sequence[str], title: str) -> str:
        lines = [f"/* {title} */", f'#include "{self.name}.h"', "", "#include <math.h>", ""]
        lines += [f"const {self.name}_parameters {self.name}_defaults = {{"]
        names = self.fields["parameters"]
        lines += [f"    {c_literal(v)}, /* {n} */" for n, v in zip(names, defaults, strict=True)] or ["    0.0"]
        lines += ["};", "", *self._field(graph.field), "", *self._stage_functions(), "", *self._stepping(), ""]
        lines += [*self._reading(), "", *self._starting(graph, start), ""]
        return "\n".join(lines)

    def _arguments(self) -> str:
        return f"const {self.name}_input *u, const {self.name}_parameters *p"

    def _init(self) -> str:
        given = "".join(f", double {name}" for name in self.start)
        return f"void {self.name}_init({self.name}_state *x, {self._arguments()}{given})"

    def _step(self) -> str:
        n, indent = self.name, " " * (len(self.name) + 11)
        inputs = f"const {n}_input *before, const {n}_input *after"
        return f"void {n}_step({n}_state *x, {inputs}, double dt,\n{indent}const {n}_parameters *p, {n}_output *y)"

    def _read(self) -> str:
        return f"void {self.name}_read(const {self.name}_state *x, {self._arguments()}, {self.name}_output *y)"

    def _field(self, function: ca.Function) -> list[str]:
        """The function for the rates of the states and, if y is not null, the readings, whose values come last."""
        order = ordered(function)
        body = CBody(order, self._sources())
        lines = body.lines((*order.once, *order.moving))
        lines += [f"f->{n} = {body.text(v)};" for n, v in zip(self.fields["state"], order.rates, strict=True)]
        lines += ["if (!y) {", "    return;", "}", *body.lines(order.reading)]
        lines += [f"y->{n} = {body.text(v)};" for n, v in zip(self.fields["output"], order.readings, strict=True)]
        head = f"static void field(const {self.name}_state *x, {self._arguments()}, {self.name}_state *f, "
        return _function([f"{head}{self.name}_output *y)"], [*_touch("x u p f", lines), *lines])

    def _sources(self) -> list[list[str]]:
        """The C expressions of the arguments (x, u, p) of a field."""
        groups = (("x", "state"), ("u", "input"), ("p", "parameters"))
        return [[f"{pointer}->{name}" for name in self.fields[group]] for pointer, group in groups]

    def _stage_functions(self) -> list[str]:
        """The functions for the arithmetic between the stages, field by field."""
        n = self.name
        s, u = self.fields["state"], self.fields["input"]
        move = [f"to->{f} = x->{f} + h * k->{f};" for f in s]
        total = "k1->{0} + (k2->{0} + k2->{0}) + (k3->{0} + k3->{0}) + k4->{0}"
        finish = [f"x->{f} = x->{f} + h * ({total.format(f)});" for f in s]
        between = [f"to->{f} = a->{f} + (b->{f} - a->{f}) * share;" for f in u]
        middle = [f"to->{f} = (a->{f} + b->{f}) / 2.0;" for f in u]
        state, given = f"const {n}_state *", f"const {n}_input *"
        lines = [
            *_function([f"static void move({n}_state *to, {state}x, double h, {state}k)"], move, "to x h k"),
            "",
            *_function(
                [f"static void finish({n}_state *x, double h, {state}k1, {state}k2, {state}k3, {state}k4)"],
                finish,
                "x h k1 k2 k3 k4",
            ),
            "",
            *_function([f"static void middle({n}_input *to, {given}a, {given}b)"], middle, "to a b"),
        ]
        if self.substeps > 1:
            head = f"static void between({n}_input *to, {given}a, {given}b, double share)"
            lines += ["", *_function([head], between, "to a b share")]
        return lines

    def _stepping(self) -> list[str]:
        n, sub = self.name, self.substeps
        stages = [
            "middle(&m, {0}, {1});",
            "field(x, {0}, p, &k1, {2});",
            "move(&s, x, h / 2.0, &k1);",
            "field(&s, &m, p, &k2, 0);",
            "move(&s, x, h / 2.0, &k2);",
            "field(&s, &m, p, &k3, 0);",
            "move(&s, x, h, &k3);",
            "field(&s, {1}, p, &k4, 0);",
            "finish(x, h / 6.0, &k1, &k2, &k3, &k4);",
        ]
        empty = [] if self.fields["input"] else ["m.nothing = 0.0;"]
        if sub == 1:
            names = [f"{n}_state s, k1, k2, k3, k4;", f"{n}_input m;", "const double h = dt;"]
            body = [*names, *empty, *(line.format("before", "after", "y") for line in stages)]
        else:
            names = [f"{n}_state s, k1, k2, k3, k4;", f"{n}_input a = *before, b, m;"]
            names += [f"const double h = dt / {c_literal(sub)};", "int i;"]
            looped = [
                f"if (i < {sub}) {{",
                f"    between(&b, before, after, (double)i / {c_literal(sub)});",
                "} else {",
                "    b = *after;",
                "}",
                *(line.format("&a", "&b", "i == 1 ? y : 0") for line in stages),
                "a = b;",
            ]
            body = [*names, *empty, f"for (i = 1; i <= {sub}; i++) {{", *(f"    {line}" for line in looped), "}"]
        return _function(self._step().split("\n"), body)

    def _reading(self) -> list[str]:
        return _function([self._read()], [f"{self.name}_state unused;", "field(x, u, p, &unused, y);"])

    def _starting(self, graph: Graph, start: Sequence[str]) -> list[str]:
        """The function for the initial state, from the given starts, inputs and parameters."""
        x, u, p = symbols(graph.states), symbols(graph.inputs), symbols(graph.constants)
        fixed = {n: v for n, v in graph.starts.items() if n not in start}
        known = [fixed.get(n, s) for n, s in x.items()]
        law = graph.start(frozenset(graph.starts) | frozenset(start))
        first = law(column(known), column(u.values()), column(p.values()))[0]
        sources = [column(part.values()) for part in (x, u, p)]
        order = ordered(ca.Function("start", sources, [ca.densify(first), ca.SX(0, 1)], {"cse": True}))
        body = CBody(order, [list(self.fields["state"]), *self._sources()[1:]])  # of x, only the given starts are read
        lines = body.lines((*order.once, *order.moving))
        lines += [f"x->{n} = {body.text(v)};" for n, v in zip(self.fields["state"], order.rates, strict=True)]
        return _function([self._init()], [*_touch("x u p", lines), *lines])


def _function(head: Sequence[str], body: Sequence[str], arguments: str = "") -> list[str]:
    return [*head, "{", *(f"    {line}" for line in [*_touch(arguments, body), *body]), "}"]


def _touch(arguments: str, body: Sequence[str]) -> list[str]:
    """``(void)`` lines for the arguments that a body does not use, to avoid compiler warnings."""
    text = "\n".join(body)
    return [f"(void){name};" for name in arguments.split() if not re.search(rf"\b{name}\b", text)]


def plain(text: str) -> str:
    """The text without comment marks, for use in a comment."""
    return text.replace("*/", "* /").replace("/*", "/ *")
