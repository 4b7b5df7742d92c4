"""Selection of the backend that runs a graph, and the largest number of tangent directions per kernel."""

from __future__ import annotations

import os
from typing import Literal

from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.kernel import Kernel, Seeds

Backend = Literal["auto", "llvm", "vm"]
# Unknowns per kernel; more of them take several kernels. The values, which cost as much as the tangents of 20 unknowns,
# are computed once for all of a kernel's unknowns. A vehicle's 55 candidates take a fifth less time in one than in two.
MOST_DIRECTIONS = 64
GROUP = 8  # unknowns whose tangents are computed at once
VARIABLE = "VDYN_BACKEND"


def chosen(backend: Backend) -> Backend:
    """The backend to use: as requested; for "auto" the environment variable, else machine code where available.

    Raises
    ------
    ValueError : no such backend.
    """
    name = os.environ.get(VARIABLE, "auto") if backend == "auto" else backend
    if name == "auto":
        from vdyn_cli.engine.native import available

        return "llvm" if available() else "vm"
    if name == "vm":
        return "vm"
    if name == "llvm":
        return "llvm"
    raise ValueError(f"there is no backend {name!r}: llvm, vm or auto (also for the variable {VARIABLE})")


def build(graph: Graph, seeds: Seeds, backend: Backend) -> Kernel:
    """A kernel for a graph and at most MOST_DIRECTIONS unknowns; see kernel.py.

    Parameters
    ----------
    seeds : the unknowns of the tangent directions. backend : llvm, vm or auto.

    Raises
    ------
    ValueError : there is no such backend.
    """
    if chosen(backend) == "vm":
        from vdyn_cli.engine.vm import VirtualMachine

        return VirtualMachine(graph, seeds)
    from vdyn_cli.engine.native import MachineCode

    return MachineCode(graph, seeds)
