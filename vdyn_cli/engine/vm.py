"""The steps of a graph on CasADi's own virtual machine: the fallback, and the test of the machine code."""

from __future__ import annotations

from typing import Any

import casadi as ca
import numpy as np

from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.kernel import Array

ROWS = 128


class VirtualMachine:
    """A kernel of a fixed number of steps; a shorter call is filled up with steps of length zero."""

    rows = ROWS

    def __init__(self, graph: Graph, lanes: int, seeded: frozenset[int]) -> None:
        self.lanes = lanes
        self._seeded = sorted(seeded)
        step = _with_tangents(graph.step, lanes, self._seeded) if lanes else graph.step
        chain = step.mapaccum(ROWS)
        self._held = [np.zeros(chain.nnz_in(k)) for k in range(chain.n_in())]
        self._got = [np.zeros(chain.nnz_out(k)) for k in range(chain.n_out())]
        self._buffer, self._run = chain.buffer()
        for k, array in enumerate(self._held):
            self._buffer.set_arg(k, memoryview(array))  # type: ignore[call-arg,arg-type]
        for k, array in enumerate(self._got):
            self._buffer.set_res(k, memoryview(array))  # type: ignore[call-arg,arg-type]

    def __call__(
        self,
        n: int,
        x: Array,
        u: Array,
        dt: Array,
        p: Array,
        x_tangents: Array,
        p_tangents: Array,
        readings: Array,
        reading_tangents: Array,
    ) -> None:
        states, inputs, outputs = x.shape[1], u.shape[1], readings.shape[1]
        start, before, after, steps, constants = self._held[:5]
        width = states * (1 + self.lanes)
        start[:states] = x[0]
        start[states:] = x_tangents[0].ravel() if self.lanes else ()
        _fill(before.reshape(ROWS, inputs), u[:n])
        _fill(after.reshape(ROWS, inputs), u[1 : n + 1])
        steps[:n], steps[n:] = dt[:n], 0.0
        constants.reshape(ROWS, p.size)[:] = p
        if self.lanes:
            self._held[5].reshape(ROWS, -1)[:] = p_tangents[self._seeded].ravel()
        self._run()
        passed = self._got[0].reshape(ROWS, width)[:n]
        x[1 : n + 1] = passed[:, :states]
        seen = self._got[1].reshape(ROWS, outputs * (1 + self.lanes))[:n]
        readings[:n] = seen[:, :outputs]
        if self.lanes:
            x_tangents[1 : n + 1] = passed[:, states:].reshape(n, states, self.lanes)
            reading_tangents[:n] = seen[:, outputs:].reshape(n, outputs, self.lanes)


def _fill(rows: Array, given: Array) -> None:
    """Copy, and repeat the last row to the end, so that the filling steps see values that occur."""
    n = given.shape[0]
    rows[:n] = given
    rows[n:] = given[-1]


def _with_tangents(step: ca.Function, lanes: int, seeded: list[int]) -> ca.Function:
    """The step that carries K directional derivatives of its state along; rows of a tangent block are the lanes."""
    x, u0, u1, dt, p = (ca.SX.sym(step.name_in(k), *step.size_in(k)) for k in range(5))
    x_tangents, p_tangents = ca.SX.sym("dx", lanes, x.numel()), ca.SX.sym("dp", lanes, len(seeded))
    after, readings = step(x, u0, u1, dt, p)
    free: Any = ca.vertcat(x, p[seeded])
    seeds = ca.vertcat(x_tangents.T, p_tangents.T)
    carried = ca.jtimes(ca.vertcat(after, readings), free, seeds)
    moved = ca.vertcat(after, ca.vec(carried[: x.numel(), :].T))
    seen = ca.vertcat(readings, ca.vec(carried[x.numel() :, :].T))
    state = ca.vertcat(x, ca.vec(x_tangents))
    whole = ca.Function("carry", [x, x_tangents, u0, u1, dt, p, p_tangents], [moved, seen])
    flat = ca.SX.sym("state", state.numel())
    block = ca.reshape(flat[x.numel() :], lanes, x.numel())
    moved, seen = whole(flat[: x.numel()], block, u0, u1, dt, p, p_tangents)
    return ca.Function("step", [flat, u0, u1, dt, p, p_tangents], [ca.densify(moved), ca.densify(seen)], {"cse": True})
