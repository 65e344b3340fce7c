"""Points of a scan from files, with its triangles if it has some: .obj, .npz, .glb, .ply."""

from __future__ import annotations

from collections.abc import Callable
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from plyfile import PlyData, PlyParseError

from avatar_export.readers.mesh_files import read_mesh
from avatar_export.readers.whole_files import read_bytes
from avatar_runtime.avatar import F64, I64
from avatar_runtime.codec.glb import accessor, decode
from avatar_runtime.errors import AvatarError

MAX_BYTES = 512 << 20
TRIANGLES = 4  # glTF's mode
FURTHEST = 1e9  # a coordinate beyond is a slip

Mesh = tuple[F64, I64 | None]  # points [N, 3], triangles [F, 3]


def read_points(path: Path) -> Mesh:
    """(points [N, 3], triangles [F, 3] or None) in the file's frame and unit.

    .obj and .npz (`vertices`, `faces`), the first mesh of a .glb as it is stored, .ply. Raises AvatarError for any
    other file, for one that is unsound, and for points that are not finite.
    """
    points, triangles = _reader(path)(path)
    if not len(points):
        raise AvatarError("has no points", file=path)
    sound = (np.abs(points) <= FURTHEST).all(axis=1)
    if not sound.all():
        raise AvatarError("is not a finite place", file=path, field=f"point {int(np.argmin(sound))}")
    if triangles is not None and not 0 <= triangles.min(initial=0) <= triangles.max(initial=0) < len(points):
        raise AvatarError(f"names points beyond the {len(points)} there are", file=path, field="triangles")
    return points, triangles


def _reader(path: Path) -> Callable[[Path], Mesh]:
    readers = {".obj": _mesh, ".npz": _mesh, ".glb": _glb, ".ply": _ply}
    read = readers.get(path.suffix.lower())
    if read is None:
        raise AvatarError(f"is no scan read here; there are {', '.join(readers)}", file=path)
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
    data = read_bytes(path, MAX_BYTES)
    try:
        elements = {element.name: element for element in PlyData.read(BytesIO(data)).elements}
        vertex = elements["vertex"]
        points = np.stack([np.asarray(vertex[axis], np.float64) for axis in "xyz"], axis=1)
    except KeyError as error:
        raise AvatarError(f"has no {error}", file=path) from None
    except (PlyParseError, ValueError, TypeError, MemoryError, OverflowError) as error:
        raise AvatarError(f"is no sound .ply ({error})", file=path) from None
    if "face" not in elements or not len(elements["face"].data):
        return points, None
    listed: Any = elements["face"].data
    name = next((n for n in ("vertex_indices", "vertex_index") if n in (listed.dtype.names or ())), None)
    if name is None or any(len(row) != 3 for row in listed[name]):
        raise AvatarError("has faces that are no triangles; triangulate the mesh", file=path, field="face")
    return points, np.stack(list(listed[name])).astype(np.int64)


def _rows_of_three(indices: Any, path: Path) -> I64:
    if len(indices) % 3:
        raise AvatarError(f"are {len(indices)}, not threes", file=path, field="indices")
    rows: I64 = indices.reshape(-1, 3).astype(np.int64)
    return rows
