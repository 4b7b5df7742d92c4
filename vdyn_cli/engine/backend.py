"""Which backend runs a graph, and with how many tangent directions."""

from __future__ import annotations

import os
from typing import Literal

from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.kernel import Kernel, Seeds

Backend = Literal["auto", "llvm", "vm"]
# Unknowns per kernel; more take several passes. With the full vehicle's states twice as many would exceed the first
# cache, and the vectors of 17 to 31 unknowns would be partly empty.
MOST = 16
VARIABLE = "VDYN_BACKEND"


def chosen(backend: Backend) -> Backend:
    """Machine code where available, unless requested otherwise; the environment variable applies to "auto" only.

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
    """A kernel for a graph and at most MOST unknowns; see kernel.py.

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
