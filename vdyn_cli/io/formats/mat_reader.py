"""MATLAB files: vectors, columns of matrices, and fields of structs; h5py reads version 7.3, which is HDF5.

A field of a struct has the struct as its group; a column of a matrix is named ``name(:,2)``. A vector has the clock of
its struct, or else the only clock of its length.
"""

from __future__ import annotations

import zlib
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from vdyn_cli.io.formats.stored_channels import StoredChannel, damage_reported, missing_library, refuse_missing
from vdyn_cli.io.formats.stored_reader import StoredReader
from vdyn_cli.quantities.arrays import Array

_HDF5 = b"\x89HDF"
_ERRORS = (OSError, ValueError, TypeError, KeyError, IndexError, EOFError, NotImplementedError, zlib.error)
_DATA, _NAME, _UNIT = ("data", "values"), ("name", "label"), ("unit", "units")
_DEEPEST = 8  # nested structs; references in an HDF5 file may form an endless loop


@dataclass(frozen=True)
class _Leaf:
    """A numeric array of a file: its shape without dimensions of length one, and the function that loads it."""

    shape: tuple[int, ...]
    load: Callable[[], NDArray[Any]]


class _MatFile:
    """The numeric arrays of an open file."""

    row = "row"

    def __init__(self, tree: Mapping[str, Any]) -> None:
        found = list(_walk(tree, "", 0))
        self.listed = tuple(channel for channel, _ in found)
        self._load = {channel.at: load for channel, load in found}

    def line(self, channel: StoredChannel, row: int) -> int:
        """The number of a row, counted from 1."""
        return row + 1

    def columns(self, wanted: Sequence[StoredChannel]) -> Sequence[Array | None]:
        """The vectors as floating-point numbers."""
        return [np.array(self._load[channel.at](), dtype=np.float64) for channel in wanted]


Loaded = Iterator[tuple[StoredChannel, Callable[[], NDArray[Any]]]]


def _walk(node: Mapping[str, Any], path: str, depth: int) -> Loaded:
    """Every channel below a struct."""
    if depth > _DEEPEST:
        return
    for key, value in node.items():
        inner = f"{path}.{key}" if path else key
        unit = _text(node, (f"{key}_unit", *_UNIT))
        if isinstance(value, _Leaf):
            yield from _vectors(key, value, path, inner, unit)
        elif isinstance(value, Mapping):
            yield from _named(value, path, inner, depth)
        elif isinstance(value, (list, tuple)):
            for n, part in enumerate(value):
                if isinstance(part, Mapping):
                    yield from _named(part, path, f"{inner}({n + 1})", depth)


def _named(node: Mapping[str, Any], path: str, inner: str, depth: int) -> Loaded:
    """The channels of a struct: one with fields such as ``Name, Data, Unit`` is one channel, any other a group."""
    name, data = _text(node, _NAME), next((v for k, v in node.items() if k.lower() in _DATA), None)
    if name and isinstance(data, _Leaf) and len(data.shape) == 1:
        yield from _vectors(name, data, path, inner, _text(node, _UNIT))
    else:
        yield from _walk(node, inner, depth + 1)


def _vectors(name: str, leaf: _Leaf, group: str, at: str, unit: str) -> Loaded:
    if len(leaf.shape) == 1 and leaf.shape[0] > 1:
        yield StoredChannel(name, unit, (group, leaf.shape[0]), at, group), leaf.load
    elif len(leaf.shape) == 2 and leaf.shape[0] >= leaf.shape[1]:
        for n in range(leaf.shape[1]):
            column = f"(:,{n + 1})"
            stored = StoredChannel(name + column, unit, (group, leaf.shape[0]), at + column, group)
            yield stored, partial(_column, leaf, n)


def _column(leaf: _Leaf, n: int) -> NDArray[Any]:
    return leaf.load()[:, n]


def _text(node: Mapping[str, Any], keys: Sequence[str]) -> str:
    """The first text of a struct under one of some keys, ignoring case."""
    return next((v.strip() for k in keys for n, v in node.items() if n.lower() == k.lower() and isinstance(v, str)), "")


@contextmanager
def _opened(path: Path) -> Iterator[_MatFile]:
    refuse_missing(path)
    with path.open("rb") as stream:
        head = stream.read(520)
    with ExitStack() as stack:
        if head.startswith(b"MATLAB 7.3") or head.startswith(_HDF5) or head[512:516] == _HDF5:
            try:
                import h5py
            except ImportError:
                missing_library(path, "h5py", "mat", "a MATLAB 7.3 file (save it with '-v7', or install the library)")
            with damage_reported(path, "h5py", *_ERRORS):
                opened = stack.enter_context(h5py.File(path, "r"))
                tree = {k: _hdf5_value(opened, v, 0) for k, v in opened.items() if not k.startswith("#")}
        else:
            with damage_reported(path, "scipy", *_ERRORS):
                tree = _version_5(path)
        with damage_reported(path, "its library", *_ERRORS):
            yield _MatFile(tree)


def _version_5(path: Path) -> dict[str, Any]:
    """The variables of a file before version 7.3; plain arrays are loaded when they are used."""
    from scipy.io import loadmat, whosmat

    plain = {"double", "single", "logical"} | {f"{u}int{b}" for u in ("", "u") for b in (8, 16, 32, 64)}
    found: dict[str, Any] = {}
    nested = []
    for name, shape, kind in whosmat(path):
        if kind in plain:
            sizes = tuple(n for n in shape if n != 1)
            found[name] = _Leaf(sizes, partial(_variable, path, name))
        else:
            nested.append(name)
            found[name] = None  # keeps the file's order
    if nested:
        loaded = loadmat(path, variable_names=nested, simplify_cells=True)
        found |= {name: _version_5_value(loaded.get(name), 0) for name in nested}
    return found


def _variable(path: Path, name: str) -> NDArray[Any]:
    from scipy.io import loadmat

    return np.asarray(loadmat(path, variable_names=[name])[name]).squeeze()


def _version_5_value(value: Any, depth: int) -> Any:
    if depth > _DEEPEST:
        return None
    if isinstance(value, Mapping):
        return {k: _version_5_value(v, depth + 1) for k, v in value.items()}
    if isinstance(value, np.ndarray) and value.dtype.kind in "biuf":
        squeezed = value.squeeze()
        return _Leaf(squeezed.shape, lambda: squeezed)
    if isinstance(value, np.ndarray) and value.dtype == object:
        return [_version_5_value(v, depth + 1) for v in value.ravel()]
    if isinstance(value, list):
        return [_version_5_value(v, depth + 1) for v in value]
    return value if isinstance(value, str) else None


def _hdf5_value(file: Any, node: Any, depth: int) -> Any:
    """A struct as a mapping, an array of structs as a list of mappings, text as str, numbers as a leaf."""
    if depth > _DEEPEST:
        return None
    if hasattr(node, "items"):
        fields = {k: _hdf5_value(file, v, depth + 1) for k, v in node.items()}
        lengths = {len(v) for v in fields.values() if isinstance(v, list)}
        if lengths and len(lengths) == 1 and all(isinstance(v, list) for v in fields.values()):
            return [dict(zip(fields, row, strict=True)) for row in zip(*fields.values(), strict=True)]
        return fields
    kind = node.attrs.get("MATLAB_class", b"")
    kind = kind.decode() if isinstance(kind, bytes) else str(kind)
    if node.dtype == object:
        return [_hdf5_value(file, file[reference], depth + 1) for reference in node[()].ravel()]
    if kind == "char":
        return "".join(map(chr, np.asarray(node[()]).ravel(order="F" if node.ndim < 2 else "C")))
    if node.dtype.kind not in "biuf" or node.attrs.get("MATLAB_empty", 0):
        return None
    sizes = tuple(n for n in reversed(node.shape) if n != 1)
    return _Leaf(sizes, lambda: node[()].T.squeeze())


def _begins(head: bytes, path: Path) -> bool:
    """Whether a file begins like a MATLAB 5 to 7.3 file, or is an HDF5 file named ``.mat``."""
    return head.startswith((b"MATLAB 5.0", b"MATLAB 7.3")) or (head.startswith(_HDF5) and path.suffix == ".mat")


READER = StoredReader(_begins, _opened)
