"""The points of a scan, and its triangles if it has any, from an .obj, .npz, .glb or .ply."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from avatar_export.formats.mesh_files import read_mesh
from avatar_runtime.avatar import F64, I64
from avatar_runtime.codec.glb import accessor, decode
from avatar_runtime.codec.ply import MAX_HEADER_BYTES, POSITION, SCALARS
from avatar_runtime.codec.ply import decode as decode_ply
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.io.whole_files import read_bytes

MAX_BYTES = 512 << 20
TRIANGLES = 4  # glTF's mode
FURTHEST = 1e9  # in any unit; a larger coordinate is a mistake

Mesh = tuple[F64, I64 | None]  # points [N, 3], triangles [F, 3]


def read_points(path: Path) -> Mesh:
    """(points [N, 3], triangles [F, 3] or None) in the file's frame and unit.

    .obj and .npz (`vertices`, `faces`), the first mesh of a .glb as it is stored, the points of a binary
    .ply. Raises AvatarError for any other file, for one that is unsound, and for points that are not finite.
    """
    points, triangles = _reader(path)(path)
    if not len(points):
        raise AvatarError("has no points", file=path)
    sound = (np.abs(points) <= FURTHEST).all(axis=1)
    if not sound.all():
        raise AvatarError("is not finite or too far away", file=path, field=f"point {int(np.argmin(sound))}")
    if triangles is not None and not 0 <= triangles.min(initial=0) <= triangles.max(initial=0) < len(points):
        raise AvatarError(
            f"name points that do not exist; there are {len(points)}", file=path, field="triangles"
        )
    return points, triangles


def _reader(path: Path) -> Callable[[Path], Mesh]:
    readers = {".obj": _mesh, ".npz": _mesh, ".glb": _glb, ".ply": _ply}
    read = readers.get(path.suffix.lower())
    if read is None:
        raise AvatarError(f"is not a scan that can be read; supported are {', '.join(readers)}", file=path)
    return read


def _mesh(path: Path) -> Mesh:
    mesh = read_mesh(path)
    return mesh.vertices.astype(np.float64), mesh.triangles.astype(np.int64)


def _glb(path: Path) -> Mesh:
    glb = decode(read_bytes(path, MAX_BYTES), path)
    primitives = glb.entry("meshes", 0).get("primitives")
    first = primitives[0] if isinstance(primitives, list) and primitives else None
    attributes = first.get("attributes") if isinstance(first, dict) else None
    if not isinstance(first, dict) or not isinstance(attributes, dict):
        raise AvatarError("has no primitive with attributes", file=path, field="meshes[0]")
    if first.get("mode", TRIANGLES) != TRIANGLES:
        raise AvatarError("is not made of triangles", file=path, field="meshes[0].primitives[0].mode")
    points = accessor(glb, attributes.get("POSITION"))
    if points.ndim != 2 or points.shape[1] != 3:
        raise AvatarError(f"POSITION is {list(points.shape)}, not [rows, 3]", file=path, field="meshes[0]")
    if "indices" not in first:
        return points.astype(np.float64), None
    return points.astype(np.float64), _rows_of_three(accessor(glb, first["indices"]), path)


def _ply(path: Path) -> Mesh:
    ply = decode_ply(_vertices_alone(read_bytes(path, MAX_BYTES)), path)
    missing = [axis for axis in POSITION if axis not in ply.properties]
    if missing:
        raise AvatarError(f"has no property {missing[0]}", file=path, field="vertex")
    return np.stack([ply.properties[axis].astype(np.float64) for axis in POSITION], axis=1), None


def _vertices_alone(data: bytes) -> bytes:
    """A .ply without the elements after its first one, such as faces; unchanged if the header is not understood."""
    header, end, _ = data[:MAX_HEADER_BYTES].partition(b"end_header\n")
    lines = header.splitlines()
    starts = [i for i, line in enumerate(lines) if line.startswith(b"element")]
    if not end or len(starts) < 2:
        return data
    words = [line.split() for line in lines[starts[0] : starts[1]]]
    kinds = [word[1].decode("ascii", "replace") for word in words[1:] if len(word) == 3]
    count = words[0][-1]
    if not count.isdigit() or len(count) > 12 or any(kind not in SCALARS for kind in kinds):
        return data
    size = int(count) * sum(np.dtype(SCALARS[kind]).itemsize for kind in kinds)
    first = len(header) + len(end)
    return b"\n".join([*lines[: starts[1]], end]) + data[first : first + size]


def _rows_of_three(indices: Any, path: Path) -> I64:
    if len(indices) % 3:
        raise AvatarError(f"are {len(indices)}, which is not a multiple of 3", file=path, field="indices")
    rows: I64 = indices.reshape(-1, 3).astype(np.int64)
    return rows
