"""Integration along a grid by kernels, with outputs and states at its samples."""

from __future__ import annotations

import os
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np

from vdyn_cli.engine.backend import GROUP, MOST_DIRECTIONS
from vdyn_cli.engine.drive import Drive
from vdyn_cli.engine.finite import diverged_first, first_not_finite, not_finite
from vdyn_cli.engine.kernel import Kernel, from_groups
from vdyn_cli.quantities.arrays import Array

# Integration steps from which several threads are used: a step takes 1 to 4 us, starting a thread some 0.2 ms.
WORTH_A_THREAD = 5000


@dataclass(frozen=True, eq=False)
class Grid:
    """The integration steps (substeps) of a drive.

    Parameters
    ----------
    time : (n,) s, the samples.
    substeps : number per sample; the last sample has one of length zero, for the readings.
    inputs : (steps + 1, inputs), at the start of each substep and at the end of the last.
    steps : (steps,) s, lengths of the substeps.
    """

    time: Array
    substeps: int
    inputs: Array
    steps: Array


def grid(drive: Drive, names: Sequence[str], substeps: int) -> Grid:
    """The substeps of a drive, with linearly interpolated inputs.

    Parameters
    ----------
    drive : time (n,) s and inputs. names : inputs in the kernel's order. substeps : per sample interval.
    """
    sub, time = substeps, drive.time
    coarse = np.empty((time.size, len(names)))
    for i, name in enumerate(names):
        coarse[:, i] = drive.inputs[name]
    moving = (time.size - 1) * sub
    steps = np.zeros(moving + 1)
    steps[:moving] = np.repeat(np.diff(time) / sub, sub)
    inputs = np.empty((steps.size + 1, coarse.shape[1]))
    for j in range(sub):
        inputs[j:moving:sub] = coarse[:-1] + (coarse[1:] - coarse[:-1]) * (j / sub)
    for name in drive.between:
        begun = (time[:-1, None] + np.diff(time)[:, None] * (np.arange(sub) / sub)).ravel()
        inputs[:moving, names.index(name)] = np.interp(begun, *drive.line(name))
    inputs[moving:] = coarse[-1]
    return Grid(time, sub, inputs, steps)


@dataclass(frozen=True, eq=False)
class GridReadings:
    """Outputs at a grid's samples: each row is the time series of one reading or one state.

    Parameters
    ----------
    readings : (m, n). tangents : (m, n, k). trajectory : (states, n), empty unless requested.
    """

    readings: Array
    tangents: Array
    trajectory: Array


@dataclass(frozen=True, eq=False)
class Integrator:
    """Kernels with their states, which ``along`` advances from the start of a drive to its end.

    Parameters
    ----------
    model, names : name of the model, and of its states followed by its outputs, for messages.
    states, readings, unknowns : numbers of each.
    kernels : one for each block of unknowns (``blocks``).
    rows : for each kernel its row of tangents and states, advanced in place.
    constants : values of the graph's constants.
    at_once : whether kernels may run in several threads.
    """

    model: str
    names: Sequence[str]
    states: int
    readings: int
    unknowns: int
    kernels: Sequence[Kernel]
    rows: Sequence[Array]
    constants: Array
    at_once: bool

    def along(self, grid: Grid, with_trajectory: bool = False) -> GridReadings:
        """Integrate along the grid of a drive.

        Parameters
        ----------
        with_trajectory : also return the states at the samples.

        Raises
        ------
        ResultError : a state, a reading or a derivative is not finite.
        """
        n = grid.time.size
        seen = GridReadings(
            np.empty((self.readings, n)),
            np.empty((self.readings, n, self.unknowns)),
            np.empty((self.states, n if with_trajectory else 0)),
        )
        work = list(zip(self.kernels, self.rows, direction_slices(self.unknowns), strict=True))
        several = self.at_once and grid.steps.size >= WORTH_A_THREAD
        workers = min(len(work), os.cpu_count() or 1) if several else 1
        if workers < 2:
            for kernel, z, some in work:
                self._run(kernel, z, grid, seen, seen.tangents[:, :, some])
            return seen
        with ThreadPoolExecutor(workers) as pool:  # all write the same readings
            for done in [pool.submit(self._run, k, z, grid, seen, seen.tangents[:, :, some]) for k, z, some in work]:
                done.result()
        return seen

    def _run(self, kernel: Kernel, z: Array, grid: Grid, seen: GridReadings, tangents: Array) -> None:
        """Run one kernel, in batches of steps that limit the memory."""
        total, sub, directions, m = grid.steps.size, grid.substeps, kernel.directions, self.readings
        rows = min(total, kernel.steps(sub))
        w, passed = np.zeros((rows, m * (directions + 1))), np.empty((rows, self.states))
        for begin in range(0, total, rows):
            n = min(rows, total - begin)
            kernel(sub, z, grid.inputs[begin:], grid.steps[begin : begin + n], self.constants, w, passed)
            at = slice(-begin % sub, n, sub)  # the substeps that begin at a sample
            with np.errstate(invalid="ignore", over="ignore"):  # a state that is not finite stays so until the end
                finite = np.isfinite(z.sum() + w[at].sum())
            if not finite:
                self._refuse_not_finite(grid, begin, passed[:n], w[:n])
            samples = slice(-(-begin // sub), (begin + n - 1) // sub + 1)
            seen.readings[:, samples] = w[at, m * directions :].T
            if directions:
                carried = from_groups(w[at, : m * directions], m, directions, kernel.width)
                tangents[:, samples] = carried[:, :, : tangents.shape[2]]
            if seen.trajectory.size:
                seen.trajectory[:, samples] = passed[at].T

    def _refuse_not_finite(self, grid: Grid, begin: int, states: Array, w: Array) -> None:
        # If only the sum in ``_run`` overflowed, all values are finite and nothing is raised.
        readings = w[:, w.shape[1] - self.readings :]
        for what, rows in (("", np.hstack([states, readings])), ("a derivative to an unknown", w)):
            if (row := first_not_finite(rows)) is not None:
                at = begin + row
                step = grid.steps[max(min(at, grid.steps.size - 1) - 1, 0)]
                raise not_finite(
                    self.model, grid.time[at // grid.substeps], step, what or diverged_first(rows, row, self.names)
                )


def direction_slices(unknowns: int) -> list[slice]:
    """Slices of the tangent directions (unknowns), one per kernel, about equal and of at most MOST_DIRECTIONS.

    One empty slice if there are no unknowns. They are cut between full groups of GROUP directions, because a kernel
    pads the last group.
    """
    groups = max(1, -(-unknowns // GROUP))
    size = GROUP * -(-groups // -(-groups * GROUP // MOST_DIRECTIONS))
    return [slice(first, min(first + size, unknowns)) for first in range(0, max(unknowns, 1), size)]
