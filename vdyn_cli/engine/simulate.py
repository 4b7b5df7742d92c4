"""Simulation with exact sensitivities: the one door to everything that integrates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from vdyn_cli.engine.backend import LANES, Backend, build, lanes_for
from vdyn_cli.engine.bench import Correction
from vdyn_cli.engine.clock import read_at
from vdyn_cli.engine.drive import Drive, Simulated
from vdyn_cli.engine.graph import refuse_unknown, trace
from vdyn_cli.engine.kernel import Array, Kernel
from vdyn_cli.engine.model import Model
from vdyn_cli.errors import Finding, ResultError

__all__ = ["Drive", "Simulated", "Simulator"]


@dataclass(frozen=True, eq=False)
class _Packed:
    """A drive in the order of the graph, on the grid of substeps."""

    inputs: Array
    steps: Array
    start: Array
    constants: Array
    given: frozenset[str]


class Simulator:
    """One model, one choice of unknowns, any number of drives.

    Parameters
    ----------
    model : the model.
    parameters : values of all its parameters; also of effects' unknowns that shall not be zero.
    unknowns : what ``theta`` holds: names of parameters, of effects' unknowns, or ``start.<state>``.
    effects : corrections, applied in this order. Their unknowns are zero (or nominal) unless given.
    substeps : Runge-Kutta steps inside each sample.
    backend : "llvm" (machine code), "vm" (CasADi's virtual machine), or "auto": machine code where it can be had.
        The environment variable VDYN_BACKEND decides for "auto".

    Raises
    ------
    ValueError : a name is not known (with the closest one), or a parameter is missing.
    """

    def __init__(
        self,
        model: Model,
        parameters: Mapping[str, float],
        unknowns: Sequence[str] = (),
        effects: Sequence[Correction] = (),
        substeps: int = 1,
        backend: Backend = "auto",
    ) -> None:
        if substeps < 1:
            raise ValueError("a sample needs at least one step")
        self.model, self.unknowns, self.effects = model, tuple(unknowns), tuple(effects)
        self._graph = graph = trace(model, self.effects)
        self._substeps, self._backend = substeps, backend
        own = [name for name in graph.constants if name not in model.context]
        refuse_unknown(f"parameter of {model.name}", parameters, own)
        if missing := [name for name in model.parameters if name not in parameters]:
            raise ValueError(f"model {model.name!r} needs a value for {', '.join(missing)}")
        starts = [f"start.{name}" for name in graph.states]
        refuse_unknown(f"unknown of {model.name}", self.unknowns, (*own, *starts))
        if len(set(self.unknowns)) < len(self.unknowns):
            raise ValueError("an unknown is listed twice")
        values = {**graph.defaults, **dict.fromkeys(model.context, np.nan), **parameters}
        self._constants = np.array([values[name] for name in graph.constants], dtype=np.float64)
        # Where theta goes, in [starts | constants].
        everywhere = [*starts, *graph.constants]
        self._places = np.array([everywhere.index(name) for name in self.unknowns], dtype=np.intp)
        self._seeds = np.zeros((len(everywhere), self._places.size))
        self._seeds[self._places, np.arange(self._places.size)] = 1.0
        self._freed = frozenset(name[6:] for name in self.unknowns if name in starts)
        self._packed: WeakKeyDictionary[Drive, _Packed] = WeakKeyDictionary()
        self._kernels: dict[int, Kernel] = {}
        self._start_laws: dict[frozenset[str], ca.Function] = {}

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self._graph.outputs

    @property
    def states(self) -> tuple[str, ...]:
        """Names of the states."""
        return self._graph.states

    def __call__(
        self, drive: Drive, theta: ArrayLike = (), *, sensitivities: bool = True, states: bool = False
    ) -> Simulated:
        """Simulate a drive with the unknowns at ``theta`` (k,).

        Raises
        ------
        ResultError : the simulation or a derivative is not finite; says when it first happened.
        ValueError : the shape of theta, or the names in the drive, do not fit.
        """
        values = np.asarray(theta, dtype=np.float64)
        if values.shape != self._places.shape:
            raise ValueError(f"theta has shape {values.shape}, there are {len(self.unknowns)} unknowns")
        packed = self._packed.get(drive)
        if packed is None:
            packed = self._packed[drive] = self._pack(drive)
        everything = np.concatenate([packed.start, packed.constants])
        everything[self._places] = values
        count = packed.start.size
        start, seeds = self._start(packed, everything[:count], everything[count:])
        k = len(self.unknowns) if sensitivities else 0
        readings = np.empty((drive.time.size, self._graph.readings))
        tangents = np.empty((*readings.shape, k))
        trail = np.empty((drive.time.size if states else 0, count))
        for first in range(0, max(k, 1), LANES[-1]):
            chunk = slice(first, min(first + LANES[-1], k))
            p, final = everything[count:], start
            final = self._run(packed, start, p, seeds[:, chunk], drive.time, readings, tangents[:, :, chunk], trail)
        return self._result(drive.time, readings, tangents, trail, final)

    def _pack(self, drive: Drive) -> _Packed:
        graph, n, sub = self._graph, drive.time.size, self._substeps
        what = f"of {self.model.name}"
        refuse_unknown(f"input {what}", drive.inputs, graph.inputs)
        refuse_unknown(f"state {what}", drive.start, graph.states)
        refuse_unknown(f"context {what}", drive.context, self.model.context)
        refuse_unknown(f"parameter {what}", drive.parameters, set(graph.constants) - set(self.model.context))
        missing = [name for name in graph.inputs if name not in drive.inputs]
        missing += [name for name in self.model.context if name not in drive.context]
        if missing:
            raise ValueError(f"model {self.model.name!r} needs {', '.join(missing)} in every drive")
        coarse = np.empty((n, len(graph.inputs)))
        for i, name in enumerate(graph.inputs):
            coarse[:, i] = drive.inputs[name]
        steps = np.zeros((n - 1) * sub + 1)  # the last step has length zero: it only reads
        steps[:-1] = np.repeat(np.diff(drive.time) / sub, sub)
        inputs = np.empty((steps.size + 1, len(graph.inputs)))
        for j in range(sub):
            inputs[j:-2:sub] = coarse[:-1] + (coarse[1:] - coarse[:-1]) * (j / sub)
        inputs[-2:] = coarse[-1]
        constants = self._constants.copy()
        for name, value in {**drive.parameters, **drive.context}.items():
            constants[graph.constants.index(name)] = value
        start = np.array([drive.start.get(name, 0.0) for name in graph.states], dtype=np.float64)
        return _Packed(inputs, steps, start, constants, frozenset(drive.start) | self._freed)

    def _start(self, packed: _Packed, x: Array, p: Array) -> tuple[Array, Array]:
        """The initial states, and the derivatives of [states | constants] to the unknowns."""
        if len(packed.given) == x.size:
            return x, self._seeds
        law = self._start_laws.get(packed.given)
        if law is None:
            law = self._start_laws[packed.given] = self._graph.start(packed.given)
        start, slopes = law(x, packed.inputs[0], p)
        seeds = self._seeds.copy()
        seeds[: x.size] = slopes.full() @ self._seeds
        return start.full()[:, 0], seeds

    def _run(
        self,
        packed: _Packed,
        start: Array,
        p: Array,
        seeds: Array,
        time: Array,
        readings: Array,
        tangents: Array,
        trail: Array,
    ) -> Array:
        """All samples with one set of lanes, a chunk at a time so that memory stays small; returns the last state."""
        kernel, total, sub = self._kernel(tangents.shape[2]), packed.steps.size, self._substeps
        lanes, nx, m, k = kernel.lanes, start.size, readings.shape[1], tangents.shape[2]
        rows = min(total, max(kernel.rows - kernel.rows % sub, sub))
        w, passed = np.empty((rows, m * (lanes + 1))), np.empty((rows, nx))
        carried = np.zeros((nx + p.size, lanes))
        carried[:, :k] = seeds[:, :k]
        z = np.concatenate([carried[:nx].ravel(), start + 0.0])  # -0.0 becomes 0.0
        for begin in range(0, total, rows):
            n = min(rows, total - begin)
            kernel(n, z, packed.inputs[begin:], packed.steps[begin:], p, carried[nx:], w, passed)
            self._refuse_not_finite(time, begin, passed[:n], w[:n], z)
            first, last = begin // sub, (begin + n - 1) // sub + 1
            readings[first:last] = w[:n:sub, m * lanes :]
            tangents[first:last] = w[:n:sub, : m * lanes].reshape(last - first, m, lanes)[:, :, :k]
            if trail.size:
                trail[first:last] = passed[:n:sub]
        return z[nx * lanes :]

    def _refuse_not_finite(self, time: Array, begin: int, states: Array, w: Array, z: Array) -> None:
        # A sum is the cheap test; that the sum alone overflows is settled by the full one.
        if np.isfinite(states.sum() + w.sum() + z.sum()):
            return
        values = np.hstack([states, w[:, w.shape[1] - self._graph.readings :]])
        for what, rows in (("simulation", values), ("derivative to an unknown", w), ("simulation", z[None])):
            odd = ~np.isfinite(rows).all(axis=1)
            if odd.any():
                row = int(np.argmax(odd)) if rows is not z else states.shape[0]
                at = min((begin + row) // self._substeps, time.size - 1)
                raise ResultError(
                    Finding(
                        f"model {self.model.name!r} at t = {time[at]:.6g} s",
                        f"the {what} is not a finite number: step too large or unstable",
                        remedy="use more substeps, or check the parameters and inputs at that time",
                    )
                )

    def _result(self, time: Array, readings: Array, tangents: Array, trail: Array, final: Array) -> Simulated:
        graph = self._graph
        outputs, sensitivities = {}, {}
        for i, name in enumerate(graph.outputs):
            value, tangent = readings[:, i], tangents[:, i]
            if name in graph.shifted:
                at = len(graph.outputs) + len(graph.rated) + graph.shifted.index(name)
                rate = rate_tangent = None
                if name in graph.rated:
                    j = len(graph.outputs) + graph.rated.index(name)
                    rate, rate_tangent = readings[:, j], tangents[:, j]
                value, tangent = read_at(time, value, rate, tangent, rate_tangent, readings[:, at], tangents[:, at])
            outputs[name], sensitivities[name] = np.ascontiguousarray(value), np.ascontiguousarray(tangent)
        states = {name: np.ascontiguousarray(trail[:, i]) for i, name in enumerate(graph.states)} if trail.size else {}
        return Simulated(time, outputs, sensitivities, dict(zip(graph.states, final.tolist(), strict=True)), states)

    def _kernel(self, unknowns: int) -> Kernel:
        lanes = lanes_for(unknowns)
        if lanes not in self._kernels:
            count = len(self._graph.states)
            seeded = frozenset(int(i) - count for i in self._places if i >= count)
            live = self._graph.live(frozenset(int(i) for i in self._places if i < count), seeded)
            self._kernels[lanes] = build(self._graph, lanes, live, seeded, self._backend)
        return self._kernels[lanes]
