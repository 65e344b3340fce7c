"""How a pack stores the elements of a section: five codecs, both directions. All integers are little-endian.

raw        the elements.
planes     records of `record` elements, byte by byte: first byte 0 of every record, then byte 1, and so on.
delta      each element minus the one before it, modulo 2^bits; then planes of one element.
pointer    uint32 [n + 1] that begins at 0 and never falls: the n differences, as narrow as they allow; then planes.
incidence  nothing: `vertex_triangle_ptr` and `vertex_triangle` follow from section `corners` of the same buffer.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.io.errors import AvatarError
from avatar_runtime.topology import vertex_triangles

Array = npt.NDArray[Any]
CODECS = ("raw", "planes", "delta", "pointer", "incidence")
BITS = {8: np.uint8, 16: np.uint16, 32: np.uint32}
MOST_VERTICES = 1 << 24  # of codec incidence, as contracts of the kernels have it


def encode(elements: Array, codec: str, record: int = 1) -> bytes:
    """The bytes of [n] elements of uint8, uint16 or uint32."""
    little = elements.astype(elements.dtype.newbyteorder("<"), copy=False)
    if codec == "raw":
        return little.tobytes()
    if codec == "planes":
        return _planes(little, record)
    if codec == "delta":
        first = np.zeros(1, elements.dtype)
        return _planes(np.diff(little, prepend=first).astype(little.dtype), 1)
    if codec == "pointer":
        counts = np.diff(elements)
        most = int(counts.max(initial=0))
        kind = np.uint8 if most < 1 << 8 else np.uint16 if most < 1 << 16 else np.uint32
        return _planes(counts.astype(kind), 1)
    assert codec == "incidence", codec
    return b""


def decode(data: memoryview, codec: str, bits: int, count: int, record: int, where: str) -> Array:
    """[count] elements. Raises AvatarError, which names the section `where`, for data of another length."""
    kind = np.dtype(BITS[bits])
    if codec == "pointer":
        return _pointer(data, count, where)
    if len(data) != count * kind.itemsize:
        raise AvatarError(
            f"stores {len(data)} bytes; {count} elements of {bits} bits take {count * kind.itemsize}",
            field=where,
        )
    if codec == "raw":
        return np.frombuffer(data, kind.newbyteorder("<")).astype(kind)
    if codec == "planes" and (record < 1 or count % record):
        raise AvatarError(f"has {count} elements, which are no whole records of {record}", field=where)
    values = _unplaned(data, kind, record if codec == "planes" else 1)
    return np.cumsum(values, dtype=kind) if codec == "delta" else values


def incidence(corners: Array, vertices: int, where: str) -> tuple[Array, Array]:
    """(vertex_triangle_ptr, vertex_triangle) of corners [3, F], flat. Raises AvatarError for a corner out of range."""
    if vertices > MOST_VERTICES:
        raise AvatarError(f"is for {vertices} vertices; {MOST_VERTICES} are the most", field=where)
    if len(corners) % 3 or (corners.size and int(corners.max()) >= vertices):
        raise AvatarError(f"has corners that are none of the {vertices} vertices", field=where)
    return vertex_triangles(corners.reshape(3, -1).T, vertices)


def _planes(elements: Array, record: int) -> bytes:
    size = record * elements.itemsize
    data = np.ascontiguousarray(elements).view(np.uint8)
    return np.ascontiguousarray(data.reshape(-1, size).T).tobytes()


def _unplaned(data: memoryview, kind: np.dtype[Any], record: int) -> Array:
    size = record * kind.itemsize
    rows = np.frombuffer(data, np.uint8).reshape(size, -1).T
    return np.ascontiguousarray(rows).reshape(-1).view(kind.newbyteorder("<")).astype(kind, copy=False)


def _pointer(data: memoryview, count: int, where: str) -> Array:
    rows = count - 1
    size = len(data) // rows if rows > 0 else 1
    if rows < 0 or size not in (1, 2, 4) or size * rows != len(data):
        raise AvatarError(f"stores {len(data)} bytes for {rows} counts", field=where)
    counts = _unplaned(data, np.dtype(BITS[8 * size]), 1) if rows else np.zeros(0, np.uint8)
    ends = np.cumsum(counts, dtype=np.uint64)
    if rows and int(ends[-1]) >= 1 << 32:
        raise AvatarError("counts more than 2^32 entries", field=where)
    return np.concatenate([[0], ends]).astype(np.uint32)
