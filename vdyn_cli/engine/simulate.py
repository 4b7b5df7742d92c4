"""Simulation with exact sensitivities: the one door to everything that integrates."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Literal
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import ArrayLike, NDArray

from vdyn_cli.engine.bench import Correction
from vdyn_cli.engine.clock import read_at
from vdyn_cli.engine.graph import Graph, refuse_unknown, trace
from vdyn_cli.engine.kernel import Array, Kernel
from vdyn_cli.engine.model import Model
from vdyn_cli.errors import Finding, ResultError

Backend = Literal["auto", "llvm", "vm"]
LANES = (1, 2, 4, 8, 16, 32)


@dataclass(frozen=True, eq=False)
class Drive:
    """One run as the simulator sees it.

    Parameters
    ----------
    time : (n,) s, increasing; any grid.
    inputs : each (n,), or one number for the whole run; linear between samples.
    start : initial states; those not given start as the model declares.
    parameters : values that differ from the simulator's in this run alone, such as air_density.
    context : the model's context in this run, such as heading.

    Raises
    ------
    ValueError : the time does not increase, or a length differs.
    """

    time: NDArray[np.float64]
    inputs: Mapping[str, ArrayLike]
    start: Mapping[str, float] = field(default_factory=dict)
    parameters: Mapping[str, float] = field(default_factory=dict)
    context: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        time = np.ascontiguousarray(self.time, dtype=np.float64)
        if time.ndim != 1 or not time.size or not np.all(np.isfinite(time)) or not np.all(np.diff(time) > 0):
            raise ValueError("the time of a drive must be one increasing row of finite numbers")
        inputs = {}
        for name, value in self.inputs.items():
            signal = np.asarray(value, dtype=np.float64)
            if signal.shape not in ((), time.shape):
                raise ValueError(f"input {name!r} has shape {signal.shape}, the time {time.shape}")
            if not np.all(np.isfinite(signal)):
                raise ValueError(f"input {name!r} has values that are not finite")
            inputs[name] = signal
        object.__setattr__(self, "time", time)
        object.__setattr__(self, "inputs", inputs)


@dataclass(frozen=True, eq=False)
class Simulated:
    """What a simulation gives, at every sample of the drive.

    Parameters
    ----------
    time : (n,) s.
    outputs : each (n,).
    sensitivities : each (n, k), derivatives of the outputs to the unknowns, in their order.
    final : the states at the last sample.
    states : each (n,); empty unless asked for.
    """

    time: NDArray[np.float64]
    outputs: Mapping[str, NDArray[np.float64]]
    sensitivities: Mapping[str, NDArray[np.float64]]
    final: Mapping[str, float]
    states: Mapping[str, NDArray[np.float64]]


@dataclass(frozen=True, eq=False)
class _Packed:
    """A drive in the order of the graph, on the grid of substeps."""

    inputs: Array
    steps: Array
    states: Array
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
        The environment variable VDYN_BACKEND overrides "auto".

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
        k = len(self.unknowns)
        self._state_seeds, self._seeds = np.zeros((len(graph.states), k)), np.zeros((len(graph.constants), k))
        for j, name in enumerate(self.unknowns):
            seeds, names = (self._seeds, graph.constants) if name in own else (self._state_seeds, starts)
            seeds[names.index(name), j] = 1.0
        self._freed = frozenset(name[6:] for name in self.unknowns if name not in own)
        self._packed: WeakKeyDictionary[Drive, _Packed] = WeakKeyDictionary()
        self._kernels: dict[int, Kernel] = {}
        self._start_laws: dict[frozenset[str], object] = {}

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
        if values.shape != (len(self.unknowns),):
            raise ValueError(f"theta has shape {values.shape}, there are {len(self.unknowns)} unknowns")
        packed = self._packed.get(drive)
        if packed is None:
            packed = self._packed[drive] = self._pack(drive)
        x, p = packed.states.copy(), packed.constants.copy()
        for j, name in enumerate(self.unknowns):
            if name in self._graph.constants:
                p[self._graph.constants.index(name)] = values[j]
            else:
                x[self._graph.states.index(name[6:])] = values[j]
        k = len(self.unknowns) if sensitivities else 0
        x, seeds = self._starts(packed, x, p)
        readings, tangents, trail, final = self._run(packed, x, p, seeds, drive.time, k, states)
        return self._result(drive.time, readings, tangents, trail, final, k)

    def _pack(self, drive: Drive) -> _Packed:
        graph, n, sub = self._graph, drive.time.size, self._substeps
        refuse_unknown(f"input of {self.model.name}", drive.inputs, graph.inputs)
        refuse_unknown(f"state of {self.model.name}", drive.start, graph.states)
        refuse_unknown(f"context of {self.model.name}", drive.context, self.model.context)
        refuse_unknown(f"parameter of {self.model.name}", drive.parameters, set(graph.constants) - set(drive.context))
        for what, needed, given in (
            ("input", graph.inputs, drive.inputs),
            ("context", self.model.context, drive.context),
        ):
            if missing := [name for name in needed if name not in given]:
                raise ValueError(f"the drive lacks the {what} {', '.join(missing)} of model {self.model.name!r}")
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
        start = np.array([drive.start.get(name, np.nan) for name in graph.states], dtype=np.float64)
        return _Packed(inputs, steps, start, constants, frozenset(drive.start) | self._freed)

    def _starts(self, packed: _Packed, x: Array, p: Array) -> tuple[Array, Array]:
        """The initial states and their derivatives to the unknowns."""
        if len(packed.given) == x.size:
            return x, self._state_seeds
        law = self._start_laws.get(packed.given)
        if law is None:
            law = self._start_laws[packed.given] = self._graph.start(packed.given)
        start, jacobian = law(np.nan_to_num(x), packed.inputs[0], p)  # type: ignore[operator]
        seeds = jacobian.full() @ np.vstack([self._state_seeds, self._seeds])
        return start.full()[:, 0], np.ascontiguousarray(seeds)

    def _run(
        self, packed: _Packed, start: Array, p: Array, seeds: Array, time: Array, k: int, keep: bool
    ) -> tuple[Array, Array, Array, Array]:
        """Readings (n, m), their tangents (n, m, k), states (n, nx) or (0, nx), and the final state."""
        n, m, nx = time.size, self._graph.readings, start.size
        readings, tangents = np.empty((n, m)), np.empty((n, m, k))
        trail, final = np.empty((n if keep else 0, nx)), start
        for first in range(0, max(k, 1), LANES[-1]):
            width = min(k - first, LANES[-1])
            kernel = self._kernel(width)
            carried = np.zeros((nx, kernel.lanes))
            carried[:, :width] = seeds[:, first : first + width]
            across = np.zeros((p.size, kernel.lanes))
            across[:, :width] = self._seeds[:, first : first + width]
            final = self._pass(
                kernel, packed, start, p, carried, across, time, readings, tangents[:, :, first : first + width], trail
            )
        return readings, tangents, trail, final

    def _pass(
        self,
        kernel: Kernel,
        packed: _Packed,
        start: Array,
        p: Array,
        carried: Array,
        across: Array,
        time: Array,
        readings: Array,
        tangents: Array,
        trail: Array,
    ) -> Array:
        """All samples with one set of tangent lanes, a chunk at a time so that the memory for states stays small."""
        total, sub = packed.steps.size, self._substeps
        rows = min(total, kernel.rows - kernel.rows % sub)
        lanes, m, width = kernel.lanes, readings.shape[1], tangents.shape[2]
        x, s = np.empty((rows + 1, start.size)), np.empty((rows + 1, start.size, lanes))
        x[0], s[0] = start, carried
        y, d = np.empty((rows, m)), np.empty((rows, m, lanes))
        final = start
        for begin in range(0, total, rows):
            n = min(rows, total - begin)
            kernel(n, x, packed.inputs[begin : begin + n + 1], packed.steps[begin : begin + n], p, s, across, y, d)
            first, count = begin // sub, -(-n // sub)
            readings[first : first + count] = y[:n:sub]
            tangents[first : first + count] = d[:n:sub, :, :width]
            if trail.size:
                trail[first : first + count] = x[:n:sub]
            self._refuse_not_finite(time, begin, x[:n], s[:n], y[:n], d[:n])
            x[0], s[0], final = x[n], s[n], x[n - 1].copy()
        return final

    def _refuse_not_finite(self, time: Array, begin: int, *blocks: Array) -> None:
        for block in blocks:
            # One sum is the cheap test; overflow of the sum itself is settled by the full one.
            if block.size and not np.isfinite(block.sum()):
                odd = ~np.isfinite(block.reshape(block.shape[0], -1)).all(axis=1)
                if odd.any():
                    step = (begin + int(np.argmax(odd))) / self._substeps
                    at = time[min(int(step), time.size - 1)]
                    what = "derivative" if block.ndim == 3 else "simulation"
                    raise ResultError(
                        Finding(
                            f"model {self.model.name!r}, t = {at:.6g} s",
                            f"the {what} is not a finite number: step too large or unstable",
                            remedy="use more substeps, or check the parameters and the inputs at this time",
                        )
                    )

    def _result(self, time: Array, readings: Array, tangents: Array, trail: Array, final: Array, k: int) -> Simulated:
        graph = self._graph
        outputs, sensitivities = {}, {}
        for i, name in enumerate(graph.outputs):
            value, tangent = np.ascontiguousarray(readings[:, i]), np.ascontiguousarray(tangents[:, i])
            if name in graph.shifted:
                at = len(graph.outputs) + len(graph.rated) + graph.shifted.index(name)
                rate = len(graph.outputs) + graph.rated.index(name) if name in graph.rated else None
                value, tangent = read_at(
                    time,
                    value,
                    None if rate is None else readings[:, rate],
                    tangent,
                    None if rate is None else tangents[:, rate],
                    readings[:, at],
                    tangents[:, at],
                )
            outputs[name], sensitivities[name] = value, tangent
        states = {name: np.ascontiguousarray(trail[:, i]) for i, name in enumerate(graph.states)} if trail.size else {}
        return Simulated(time, outputs, sensitivities, dict(zip(graph.states, final.tolist(), strict=True)), states)

    def _kernel(self, width: int) -> Kernel:
        lanes = next((lanes for lanes in LANES if lanes >= width), 0) if width else 0
        if lanes not in self._kernels:
            seeded = frozenset(int(i) for i in np.flatnonzero(self._seeds.any(axis=1)))
            self._kernels[lanes] = _build(self._graph, lanes, seeded, self._backend)
        return self._kernels[lanes]


def _build(graph: Graph, lanes: int, seeded: frozenset[int], backend: Backend) -> Kernel:
    from vdyn_cli.engine.vm import VirtualMachine

    return VirtualMachine(graph, lanes, seeded)
