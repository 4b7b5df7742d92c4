"""The steps of a graph on CasADi's virtual machine: the fallback, and the reference for tests of the machine code."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from vdyn_cli.engine.dual import Tangents, Value, instructions, tangent
from vdyn_cli.engine.graph import Graph, column
from vdyn_cli.engine.kernel import Seeds
from vdyn_cli.quantities.arrays import Array


class VirtualMachine:
    """A kernel with a fixed number of steps; a shorter call is padded with steps of length zero."""

    rows = 128

    def __init__(self, graph: Graph, seeds: Seeds) -> None:
        self.directions = self.width = seeds.constants.shape[1]
        chain = _runge_kutta(_with_tangents(graph.field, seeds)).mapaccum(self.rows)
        self._held = [np.zeros(chain.nnz_in(k)) for k in range(chain.n_in())]
        self._got = [np.zeros(chain.nnz_out(k)) for k in range(chain.n_out())]
        self._buffer, self._run = chain.buffer()
        for k, array in enumerate(self._held):
            self._buffer.set_arg(k, memoryview(array))  # type: ignore[call-arg,arg-type]
        for k, array in enumerate(self._got):
            self._buffer.set_res(k, memoryview(array))  # type: ignore[call-arg,arg-type]

    def steps(self, every: int) -> int:
        """The number of steps; the readings before all of them are computed."""
        return self.rows

    # Seven parameters: as Kernel.__call__
    def __call__(self, every: int, z: Array, u: Array, dt: Array, p: Array, w: Array, trajectory: Array) -> None:
        n = dt.size
        start, before, after, steps, constants = self._held
        start[:] = z
        _fill(before.reshape(self.rows, u.shape[1]), u[:n])
        _fill(after.reshape(self.rows, u.shape[1]), u[1 : n + 1])
        steps[:n], steps[n:] = dt, 0.0
        constants.reshape(self.rows, p.size)[:] = p
        self._run()
        passed = self._got[0].reshape(self.rows, z.size)[:n]
        trajectory[:1], trajectory[1:n] = z[z.size - trajectory.shape[1] :], passed[:-1, z.size - trajectory.shape[1] :]
        z[:] = passed[-1]
        w[:n] = self._got[1].reshape(self.rows, w.shape[1])[:n]


def _fill(rows: Array, given: Array) -> None:
    """Copy, and repeat the last row to the end, so that the padding steps have valid inputs."""
    n = given.shape[0]
    rows[:n] = given
    rows[n:] = given[-1]


class _Symbols:
    """The algebra that builds a graph: values are symbols, tangents are rows of them."""

    def value(self, op: int, *arguments: Value) -> ca.SX:
        a = [ca.SX(x) for x in arguments]
        return ca.SX.unary(op, *a) if len(a) == 1 else ca.SX.binary(op, *a)

    def scale(self, tangents: Tangents, by: Value) -> Tangents:
        return by * tangents

    def add(self, left: Tangents, right: Tangents) -> Tangents:
        return left + right

    def subtract(self, left: Tangents, right: Tangents) -> Tangents:
        return left - right

    def negate(self, tangents: Tangents) -> Tangents:
        return -tangents

    def choose(self, condition: Value, tangents: Tangents) -> ca.SX:
        return ca.SX.binary(ca.OP_IF_ELSE_ZERO, condition, tangents)


def _with_tangents(field: ca.Function, seeds: Seeds) -> ca.Function:
    """``(z, u, p) -> (rates of z, w)``; the seeds of constants are numbers in the graph, where most are zero."""
    algebra, directions = _Symbols(), seeds.constants.shape[1]
    sources = [ca.SX.sym(field.name_in(k), *field.size_in(k)) for k in range(3)]
    x_tangents = ca.SX.sym("tx", directions, sources[0].numel())
    carried = {(0, i): x_tangents[:, i].T for i in seeds.live}
    carried |= {(2, i): ca.SX(seeds.constants[i : i + 1]) for i in seeds.seeded}
    results: list[list[Any]] = [[None] * int(field.size1_out(k)) for k in range(2)]
    work: dict[int, tuple[ca.SX, ca.SX | None]] = {}
    for op, to, of, constant in instructions(field):
        if op == ca.OP_OUTPUT:
            results[to[0]][to[1]] = work[of[0]]
        elif op == ca.OP_CONST:
            work[to[0]] = ca.SX(constant), None
        elif op == ca.OP_INPUT:
            work[to[0]] = sources[of[0]][of[1]], carried.get((of[0], of[1])) if directions else None
        else:
            a, t = [work[k][0] for k in of], [work[k][1] for k in of]
            v = algebra.value(op, *a)
            work[to[0]] = v, tangent(algebra, op, a, v, t) if directions else None
    zeros = ca.SX.zeros(1, directions)
    outputs = [column([*((zeros if t is None else t).T for _, t in row), *(v for v, _ in row)]) for row in results]
    z = ca.vertcat(ca.vec(x_tangents), sources[0])
    return ca.Function("field", [z, *sources[1:]], outputs, {"cse": True})


def _runge_kutta(field: ca.Function) -> ca.Function:
    """``(z, u0, u1, dt, p) -> (z after the step, w before it)``, operation for operation as ir_steps.py."""
    z, before, p = (ca.SX.sym(field.name_in(k), *field.size_in(k)) for k in range(3))
    after, dt = ca.SX.sym("u1", before.numel()), ca.SX.sym("dt")
    middle = (before + after) / 2
    k1, w = field(z, before, p)
    k2, _ = field(z + dt / 2 * k1, middle, p)
    k3, _ = field(z + dt / 2 * k2, middle, p)
    k4, _ = field(z + dt * k3, after, p)
    moved = z + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
    return ca.Function("step", [z, before, after, dt, p], [ca.densify(moved), w], {"cse": True})
