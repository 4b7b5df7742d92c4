"""Simulation with exact sensitivities: the one door to everything that integrates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from vdyn_cli.engine.backend import MOST, Backend, build
from vdyn_cli.engine.bench import Correction
from vdyn_cli.engine.clock import read_at
from vdyn_cli.engine.drive import Drive, Simulated
from vdyn_cli.engine.graph import refuse_unknown, trace
from vdyn_cli.engine.kernel import Array, Kernel, Seeds
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
        self._built: dict[bool, list[Kernel]] = {}
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
        p, final = everything[count:], start
        for kernel, some in zip(self._kernels(k), _blocks(k), strict=True):
            final = self._run(
                kernel, packed, start, p, seeds[:, some], drive.time, readings, tangents[:, :, some], trail
            )
        return self._result(drive.time, readings, tangents, trail, final)

    def _pack(self, drive: Drive) -> _Packed:
        graph, n, sub = self._graph, drive.time.size, self._substeps
        what = f"of {self.model.name}"
        refuse_unknown(f"input {what}", drive.inputs, graph.inputs)
        refuse_unknown(f"state {what}", drive.start, graph.states)
        refuse_unknown(f"context {what}", drive.context, self.model.context)
        refuse_unknown(f"parameter {what}", drive.parameters, set(graph.constants) - set(self.model.context))
        if fixed := set(drive.parameters) & set(self.unknowns):
            raise ValueError(f"{', '.join(sorted(fixed))} cannot be an unknown and be given by a drive")
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
        starts = {**graph.starts, **drive.start}
        start = np.array([starts.get(name, 0.0) for name in graph.states], dtype=np.float64)
        return _Packed(inputs, steps, start, constants, frozenset(starts) | self._freed)

    def _start(self, packed: _Packed, x: Array, p: Array) -> tuple[Array, Array]:
        """The initial states, and their derivatives to the unknowns."""
        if len(packed.given) == x.size:
            return x, self._seeds[: x.size]
        law = self._start_laws.get(packed.given)
        if law is None:
            law = self._start_laws[packed.given] = self._graph.start(packed.given)
        start, slopes = law(x, packed.inputs[0], p)
        return start.full()[:, 0], slopes.full() @ self._seeds

    def _run(
        self,
        kernel: Kernel,
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
        total, sub, lanes = packed.steps.size, self._substeps, kernel.lanes
        nx, m, k = start.size, readings.shape[1], tangents.shape[2]
        rows = min(total, kernel.rows)
        w, passed = np.empty((rows, m * (lanes + 1))), np.empty((rows, nx))
        z = np.zeros(nx * (lanes + 1))
        z[: nx * lanes].reshape(nx, lanes)[:, :k] = seeds
        z[nx * lanes :] = start + 0.0  # -0.0 becomes 0.0
        for begin in range(0, total, rows):
            n = min(rows, total - begin)
            kernel(n, z, packed.inputs[begin:], packed.steps[begin:], p, w, passed)
            self._refuse_not_finite(time, begin, passed[:n], w[:n])
            seen = slice(-begin % sub, n, sub)  # of the substeps, those that begin a sample
            samples = slice(-(-begin // sub), (begin + n - 1) // sub + 1)
            readings[samples] = w[seen, m * lanes :]
            if lanes:
                tangents[samples] = w[seen, : m * lanes].reshape(-1, m, lanes)[:, :, :k]
            if trail.size:
                trail[samples] = passed[seen]
        final: Array = passed[n - 1]
        return final

    def _refuse_not_finite(self, time: Array, begin: int, states: Array, w: Array) -> None:
        # A sum is the cheap test; that the sum alone overflows is settled by the full one.
        with np.errstate(invalid="ignore", over="ignore"):
            if np.isfinite(states.sum() + w.sum()):
                return
        values = np.hstack([states, w[:, w.shape[1] - self._graph.readings :]])
        for what, rows in (("simulation", values), ("derivative to an unknown", w)):
            odd = ~np.isfinite(rows).all(axis=1)
            if odd.any():
                at = time[(begin + int(np.argmax(odd))) // self._substeps]
                raise ResultError(
                    Finding(
                        f"model {self.model.name!r} at t = {at:.6g} s",
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

    def _kernels(self, unknowns: int) -> list[Kernel]:
        """One for each block of unknowns; built when first asked for, with sensitivities or without."""
        kind = bool(unknowns)
        if kind not in self._built:
            count = len(self._graph.states)
            own = [int(place) for place in self._places] if kind else []
            seeded = frozenset(place - count for place in own if place >= count)
            live = self._graph.live(frozenset(place for place in own if place < count), seeded) if kind else frozenset()
            self._built[kind] = [
                build(self._graph, Seeds(self._seeds[count:, some], seeded, live), self._backend)
                for some in _blocks(unknowns)
            ]
        return self._built[kind]


def _blocks(unknowns: int) -> list[slice]:
    """The unknowns in blocks that a kernel can carry; one empty block where there are none."""
    return [slice(first, min(first + MOST, unknowns)) for first in range(0, max(unknowns, 1), MOST)]
