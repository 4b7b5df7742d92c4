"""Simulation with exact sensitivities: the only interface to time integration."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass
from threading import Lock
from weakref import WeakKeyDictionary

import casadi as ca
import numpy as np
from numpy.typing import ArrayLike

from vdyn_cli.engine.backend import Backend, build, chosen
from vdyn_cli.engine.drive import Drive, Simulated
from vdyn_cli.engine.graph import refuse_unknown, trace
from vdyn_cli.engine.integrator import Grid, GridReadings, Integrator, direction_slices, grid
from vdyn_cli.engine.kernel import Kernel, Seeds, in_groups
from vdyn_cli.engine.lead import read_ahead
from vdyn_cli.engine.model import Model
from vdyn_cli.engine.model_builder import Correction
from vdyn_cli.engine.shifted_reading import read_at
from vdyn_cli.quantities.arrays import Array

__all__ = ["Drive", "Simulated", "Simulator", "sensitive_to"]


@dataclass(frozen=True, eq=False)
class _Packed:
    """Start values and constants of a drive, in the order of the graph; ``given`` : states with a numeric start."""

    start: Array
    constants: Array
    given: frozenset[str]


class Simulator:
    """Simulates any number of drives with one model and one choice of unknowns.

    Parameters
    ----------
    model : the model.
    parameters : values of all its parameters, SI; also of effects' unknowns that differ from their neutral value.
    unknowns : names of the elements of ``theta``: parameters, effects' unknowns, or ``start.<state>``.
    effects : corrections, applied in this order. Their unknowns have their neutral value unless given.
    substeps : Runge-Kutta steps per sample interval.
    backend : "llvm" (machine code), "vm" (CasADi's virtual machine), or "auto": the environment variable VDYN_BACKEND,
        else machine code where available.

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
        # Indices of theta's elements in [starts | constants].
        everywhere = [*starts, *graph.constants]
        self._places = np.array([everywhere.index(name) for name in self.unknowns], dtype=np.intp)
        self._seeds = np.zeros((len(everywhere), self._places.size))
        self._seeds[self._places, np.arange(self._places.size)] = 1.0
        self._seeded = self._places
        self._freed = frozenset(name[6:] for name in self.unknowns if name in starts)
        self._packed: WeakKeyDictionary[Drive, _Packed] = WeakKeyDictionary()
        self._grids: WeakKeyDictionary[Drive, Grid] = WeakKeyDictionary()
        self._built: dict[bool, list[Kernel]] = {}
        self._building = Lock()
        self._start_laws: dict[frozenset[str], ca.Function] = {}

    @property
    def outputs(self) -> tuple[str, ...]:
        """Names of the outputs."""
        return self._graph.outputs

    @property
    def at_once(self) -> bool:
        """Whether several threads may simulate at once: machine code has no state between calls."""
        return chosen(self._backend) == "llvm"

    def __call__(
        self, drive: Drive, theta: ArrayLike = (), *, sensitivities: bool = True, states: bool = False
    ) -> Simulated:
        """Simulate a drive with the unknowns at ``theta`` (k,), SI.

        Raises
        ------
        ResultError : the simulation or a derivative is not finite; says which quantity first, and when.
        ValueError : the shape of theta or a name in the drive is wrong.
        """
        drive = self._ahead(drive, theta)
        packed = self._pack(drive)
        whole = self._grids.get(drive)
        if whole is None:
            whole = self._grids[drive] = grid(drive, self._graph.inputs, self._substeps)
        integrator = self._integrator(packed, whole.inputs[0], theta, sensitivities)
        return self._result(drive.time, integrator.along(whole, states))

    def _ahead(self, drive: Drive, theta: ArrayLike) -> Drive:
        """The drive with its leads and lags, from theta and the drive's parameters, applied to its inputs."""
        graph = self._graph
        if not graph.leading:
            return drive
        values = dict(zip(graph.constants, self._constants.tolist(), strict=True))
        values |= drive.parameters
        values |= zip(self.unknowns, np.asarray(theta, dtype=np.float64).tolist(), strict=True)
        leads = graph.leads([values[name] for name in graph.constants]).full()[:, 0]
        known = {key: lead for key, lead in zip(graph.leading, leads.tolist(), strict=True) if key[0] in drive.inputs}
        return read_ahead(drive, known)

    def step_error(self, drive: Drive, theta: ArrayLike = ()) -> dict[str, float]:
        """Largest change of each output when the step is halved, as a share of the output's range.

        A step that is too large does not always diverge: sliding tires keep the forces finite, and the result is noise.
        Halving the step then changes the result. Clock shifts are not applied.

        Raises
        ------
        ResultError, ValueError : as for a call.
        """
        packed = self._pack(drive)
        traces = []
        for substeps in (self._substeps, 2 * self._substeps):
            whole = grid(drive, self._graph.inputs, substeps)
            integrator = self._integrator(packed, whole.inputs[0], theta, sensitivities=False)
            traces.append(integrator.along(whole).readings[: len(self._graph.outputs)])
        apart = np.max(np.abs(traces[0] - traces[1]), axis=1)
        usual = np.ptp(traces[1], axis=1) + 1e-6 * (1.0 + np.max(np.abs(traces[1]), axis=1))
        return dict(zip(self._graph.outputs, (apart / usual).tolist(), strict=True))

    def _integrator(self, packed: _Packed, first_inputs: Array, theta: ArrayLike, sensitivities: bool) -> Integrator:
        """An integrator with each kernel's states and tangents at their start values."""
        values = np.asarray(theta, dtype=np.float64)
        if values.shape != self._places.shape:
            raise ValueError(f"theta has shape {values.shape}, there are {len(self.unknowns)} unknowns")
        everything = np.concatenate([packed.start, packed.constants])
        everything[self._places] = values
        count = packed.start.size
        start, seeds = self._start(packed, first_inputs, everything[:count], everything[count:])
        k = self._seeds.shape[1] if sensitivities else 0
        kernels, rows = self._kernels(k), []
        for kernel, some in zip(kernels, direction_slices(k), strict=True):
            tangents = in_groups(seeds[:, some], kernel.directions, kernel.width)
            z = np.concatenate([tangents.ravel(), start + 0.0])  # -0.0 becomes 0.0
            rows.append(z)
        names = (*self._graph.states, *self._graph.outputs)
        constants = everything[count:]
        return Integrator(
            self.model.name, names, count, self._graph.readings, k, kernels, rows, constants, self.at_once
        )

    def _pack(self, drive: Drive) -> _Packed:
        packed = self._packed.get(drive)
        if packed is None:
            packed = self._packed[drive] = self._checked(drive)
        return packed

    def _checked(self, drive: Drive) -> _Packed:
        graph = self._graph
        what = f"of {self.model.name}"
        refuse_unknown(f"input {what}", drive.inputs, graph.inputs)
        refuse_unknown(f"state {what}", drive.start, graph.states)
        refuse_unknown(f"context {what}", drive.context, self.model.context)
        refuse_unknown(f"parameter {what}", drive.parameters, set(graph.constants) - set(self.model.context))
        if fixed := set(drive.parameters) & set(self.unknowns):
            raise ValueError(f"{', '.join(sorted(fixed))} is both an unknown and an input of the drive")
        missing = [name for name in graph.inputs if name not in drive.inputs]
        missing += [name for name in self.model.context if name not in drive.context]
        if missing:
            raise ValueError(f"model {self.model.name!r} needs {', '.join(missing)} in every drive")
        constants = self._constants.copy()
        for name, value in {**drive.parameters, **drive.context}.items():
            constants[graph.constants.index(name)] = value
        starts = {**graph.starts, **drive.start}
        start = np.array([starts.get(name, 0.0) for name in graph.states], dtype=np.float64)
        return _Packed(start, constants, frozenset(starts) | self._freed)

    def _start(self, packed: _Packed, first_inputs: Array, x: Array, p: Array) -> tuple[Array, Array]:
        """The initial states, and their derivatives to the unknowns."""
        if len(packed.given) == x.size:
            return x, self._seeds[: x.size]
        law = self._start_laws.get(packed.given)
        if law is None:
            law = self._start_laws[packed.given] = self._graph.start(packed.given)
        start, slopes = law(x, first_inputs, p)
        return start.full()[:, 0], slopes.full() @ self._seeds

    def _result(self, time: Array, seen: GridReadings) -> Simulated:
        graph = self._graph
        outputs, sensitivities = {}, {}
        for i, name in enumerate(graph.outputs):
            value, tangent = seen.readings[i], seen.tangents[i]
            if name in graph.shifted:
                at = len(graph.outputs) + len(graph.rated) + graph.shifted.index(name)
                rate = rate_tangent = None
                if name in graph.rated:
                    j = len(graph.outputs) + graph.rated.index(name)
                    rate, rate_tangent = seen.readings[j], seen.tangents[j]
                shift, shift_tangent = seen.readings[at], seen.tangents[at]
                value, tangent = read_at(time, value, rate, tangent, rate_tangent, shift, shift_tangent)
            outputs[name], sensitivities[name] = value, tangent
        states = dict(zip(graph.states, seen.trajectory, strict=True)) if seen.trajectory.size else {}
        return Simulated(time, outputs, sensitivities, states)

    def _kernels(self, unknowns: int) -> list[Kernel]:
        """One kernel for each block of unknowns, built on the first request with or without sensitivities."""
        kind = bool(unknowns)
        with self._building:
            if kind not in self._built:
                count = len(self._graph.states)
                own = [int(place) for place in self._seeded] if unknowns else []
                seeded = frozenset(place - count for place in own if place >= count)
                live = self._graph.live(frozenset(p for p in own if p < count), seeded) if unknowns else frozenset()
                self._built[kind] = [
                    build(self._graph, Seeds(self._seeds[count:, some], seeded, live), self._backend)
                    for some in direction_slices(unknowns)
                ]
        return self._built[kind]


def sensitive_to(simulator: Simulator, names: Sequence[str]) -> Simulator:
    """The same simulator with sensitivities only to its unknowns in ``names``, in that order, which costs less."""
    some, at = copy(simulator), [simulator.unknowns.index(name) for name in names]
    some._seeds, some._seeded, some._built = simulator._seeds[:, at], simulator._places[at], {}
    return some
