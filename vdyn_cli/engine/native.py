"""Machine code from LLVM IR through llvmlite, without an installed compiler. The only module that uses llvmlite."""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache, lru_cache
from typing import Any

from vdyn_cli.engine.backend import GROUP
from vdyn_cli.engine.delayed_signals import delayed_signals
from vdyn_cli.engine.graph import Graph
from vdyn_cli.engine.ir import print_kernel
from vdyn_cli.engine.kernel import Seeds, in_groups
from vdyn_cli.engine.object_cache import cached
from vdyn_cli.quantities.arrays import Array

# Measured on models of 2 to 49 states: level 1 of the code generator is twice as fast as level 0 with tangents, higher
# levels gain nothing. Optimization passes gain nothing with tangents (CasADi has eliminated common subexpressions); on
# values alone they vectorize the equal operations of a vehicle's four corners, which gains a sixth.
_LEVEL = 1
CACHE = 2**15  # numbers that a call may write so that they are still in the cache when read: a quarter of a megabyte
WIDTHS = (0, 1, 2, 4, GROUP)  # directions of a group: full vectors; the processor would pad other numbers to these


# Passes a writable array in 0.6 us instead of 3 us for ``array.ctypes.data``; calls for short drives take 10 us.
_POINTER: Callable[[Any], object] = (ctypes.c_char * 0).from_buffer


class MachineCode:
    """A kernel in machine code; any number of steps up to ``rows`` with readings."""

    def __init__(self, graph: Graph, seeds: Seeds) -> None:
        unknowns = seeds.constants.shape[1]
        self.width = next((width for width in WIDTHS if width >= unknowns), WIDTHS[-1])
        self.directions = -(-unknowns // self.width) * self.width if unknowns else 0
        self.rows = max(1, min(1024, CACHE // (graph.readings * (1 + self.directions) + len(graph.states))))
        self._p_tangents = in_groups(seeds.constants, self.directions, self.width)
        self._run, self._owner = compiled(
            print_kernel(graph, self.width, seeds.live, seeds.seeded), vectorized=not self.width
        )

    def steps(self, every: int) -> int:
        """Most steps of a call: so many that the rows with readings stay in the cache."""
        return self.rows * every

    # Seven parameters: as Kernel.__call__
    def __call__(self, every: int, z: Array, u: Array, dt: Array, p: Array, w: Array, trajectory: Array) -> None:
        arrays = z, u, dt, p, self._p_tangents, w, trajectory
        self._run(dt.size, every, self._p_tangents.shape[0], *map(_POINTER, arrays))


@cache
def _llvm() -> Any:
    import llvmlite.binding as llvm

    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    return llvm


def available() -> bool:
    """Whether machine code is available on this machine, tested by compiling a function."""
    try:
        compiled("define void @run(ptr %z) {\nret void\n}")
    except (ImportError, OSError, RuntimeError):  # not installed, its library does not load, too old, or no such CPU
        return False
    return True


@lru_cache(maxsize=128)
def compiled(text: str, vectorized: bool = False) -> tuple[Callable[..., None], object]:
    """The compiled function ``run`` of a text of LLVM IR, and the object that must outlive it; each text compiles once.

    ``vectorized`` combines equal operations on different numbers; the results are the same to the bit.
    """
    llvm = _llvm()
    cpu, features = llvm.get_host_cpu_name(), llvm.get_host_cpu_features().flatten()

    def engine(module: Any, **cache: Callable[..., object]) -> Any:
        """An engine that has compiled a module or loaded its object code."""
        machine = llvm.Target.from_default_triple().create_target_machine(opt=_LEVEL, cpu=cpu, features=features)
        if vectorized and "notify_func" in cache:
            tuning = llvm.create_pipeline_tuning_options(speed_level=1)
            tuning.slp_vectorization = True
            passes = llvm.create_pass_builder(machine, tuning)
            passes.getModulePassManager().run(module, passes)
        made = llvm.create_mcjit_compiler(module, machine)
        made.set_object_cache(**cache)
        with delayed_signals():  # the cache is a callback
            made.finalize_object()
        return made

    def object_code() -> bytes:
        module = llvm.parse_assembly(text)
        module.verify()
        found: list[bytes] = []
        engine(module, notify_func=lambda _, code: found.append(bytes(code)))
        return found[0]

    # The engine loads the object code in place of an empty module, so that cached and new code run the same way.
    code = cached((text, str(vectorized), *_versions(llvm), str(_LEVEL), cpu, features), object_code)
    owner = engine(llvm.parse_assembly("define void @run() {\nret void\n}"), getbuffer_func=lambda _: code)
    signature = ctypes.CFUNCTYPE(None, *[ctypes.c_int64] * 3, *[ctypes.c_void_p] * 7)
    return signature(owner.get_function_address("run")), owner


def _versions(llvm: Any) -> tuple[str, ...]:
    """Versions of llvmlite and LLVM, and the target triple."""
    from llvmlite import __version__

    return __version__, ".".join(map(str, llvm.llvm_version_info)), llvm.get_default_triple()
