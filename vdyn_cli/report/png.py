"""Pictures as PNG."""

from __future__ import annotations

import struct
import zlib
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from numpy.typing import NDArray

_UP = 2  # filter: every row as its difference from the row above


def png(image: NDArray[np.uint8]) -> bytes:
    """The PNG file of an image (rows, columns, 3) of red, green and blue (ISO/IEC 15948)."""
    rows, columns, _ = image.shape
    flat = np.ascontiguousarray(image).reshape(rows, -1)
    up = np.diff(flat, axis=0, prepend=np.zeros((1, flat.shape[1]), dtype=np.uint8))
    lines = np.hstack([np.full((rows, 1), _UP, dtype=np.uint8), up])
    head = struct.pack(">IIBBBBB", columns, rows, 8, 2, 0, 0, 0)  # 8 bits, red-green-blue
    content = _chunk(b"IHDR", head) + _chunk(b"IDAT", zlib.compress(lines.tobytes(), 9)) + _chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + content


def _chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
