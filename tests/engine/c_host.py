"""Compilation of an exported C model, and its simulation from Python."""

from __future__ import annotations

import ctypes
import shutil
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from vdyn_cli.engine.c_source import CProgram

STRICT = ("-std=c99", "-Wall", "-Wextra", "-Werror", "-pedantic", "-Wshadow", "-Wconversion")


def compiler() -> str:
    """The machine's C compiler; the test is skipped where there is none."""
    found = shutil.which("gcc") or shutil.which("cc")
    if found is None:
        pytest.skip("there is no C compiler on this machine")
    return found


def build(folder: Path, sources: Sequence[str], target: str, *flags: str) -> Path:
    """Compile with every warning an error."""
    command = [compiler(), *STRICT, "-O2", *flags, *sources, "-o", target, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr[:3000]
    return folder / target


class Compiled:
    """A printed model as a shared library."""

    def __init__(self, program: CProgram, folder: Path) -> None:
        self.program = program
        (folder / f"{program.name}.h").write_text(program.header, encoding="utf-8")
        (folder / f"{program.name}.c").write_text(program.source, encoding="utf-8")
        path = build(folder, [f"{program.name}.c"], f"{program.name}.so", "-shared", "-fPIC")
        self._library = ctypes.CDLL(str(path))

    def defaults(self) -> dict[str, float]:
        count = len(self.program.parameters)
        values = (ctypes.c_double * count).in_dll(self._library, f"{self.program.name}_defaults")
        return dict(zip(self.program.parameters, values, strict=True))

    def simulate(
        self,
        time: np.ndarray,
        inputs: Mapping[str, Any],
        parameters: Mapping[str, float],
        start: Sequence[float] = (),
    ) -> dict[str, np.ndarray]:
        """The outputs at every sample."""
        program, n = self.program, time.size
        u = np.empty((n, max(len(program.inputs), 1)))
        for i, name in enumerate(program.inputs):
            u[:, i] = inputs[name]
        p = np.array([parameters[name] for name in program.parameters] or [0.0])
        x, y = np.full(len(program.states), np.nan), np.empty((n, len(program.outputs)))
        init, step, read = (getattr(self._library, f"{program.name}_{f}") for f in ("init", "step", "read"))
        here, px, pp = u.ctypes.data, ctypes.c_void_p(x.ctypes.data), ctypes.c_void_p(p.ctypes.data)
        init(px, ctypes.c_void_p(here), pp, *(ctypes.c_double(value) for value in start))
        for k, dt in enumerate(np.diff(time)):
            before, after = (ctypes.c_void_p(here + j * u.strides[0]) for j in (k, k + 1))
            step(px, before, after, ctypes.c_double(dt), pp, ctypes.c_void_p(y.ctypes.data + k * y.strides[0]))
        last = (n - 1) * u.strides[0]
        read(px, ctypes.c_void_p(here + last), pp, ctypes.c_void_p(y.ctypes.data + (n - 1) * y.strides[0]))
        return {name: y[:, i] for i, name in enumerate(program.outputs)}
