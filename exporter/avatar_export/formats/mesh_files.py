"""Triangle meshes from files, numbered as in the file: .obj, or .npz with vertices and faces."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.archive import Archive
from avatar_export.formats.casts import as_float32
from avatar_export.formats.npy import parse_npy
from avatar_export.formats.obj import TriangleMesh, read_obj
from avatar_runtime.io.errors import AvatarError

MAX_ARRAY_BYTES = 1 << 30

Array = npt.NDArray[Any]


def read_mesh(path: Path) -> TriangleMesh:
    """The mesh of an .obj, or of an .npz with `vertices` [V, 3] and `faces` [F, 3].

    Raises AvatarError for any other file, and for one that is unsound.
    """
    if not path.exists():
        raise AvatarError("no such file", file=path)
    read = {".obj": read_obj, ".npz": _read_npz}.get(path.suffix.lower())
    if read is None:
        raise AvatarError(
            "is not a mesh file that can be read; pass an .obj, or an .npz with vertices and faces", file=path
        )
    return read(path)


def _read_npz(path: Path) -> TriangleMesh:
    with Archive(path) as archive:
        missing = [key for key in ("vertices", "faces") if f"{key}.npy" not in archive.names]
        if missing:
            there = ", ".join(sorted(name.removesuffix(".npy") for name in archive.names)[:6])
            raise AvatarError(f"needs arrays vertices and faces, but holds {there or 'nothing'}", file=path)
        stored_vertices = _rows(archive, "vertices", "f", "floats")
        faces = _rows(archive, "faces", "iu", "whole numbers").astype(np.int64)
    vertices = as_float32(stored_vertices)
    finite = np.isfinite(vertices).all(axis=1)
    if not finite.all():
        raise AvatarError("is not finite in float32", file=path, field=f"vertices[{int(np.argmin(finite))}]")
    outside = ((faces < 0) | (faces >= len(vertices))).any(axis=1)
    if outside.any():
        at = int(np.argmax(outside))
        raise AvatarError(
            f"is {faces[at].tolist()}, but there are {len(vertices)} vertices",
            file=path,
            field=f"faces[{at}]",
        )
    return TriangleMesh(vertices, faces.astype(np.uint32))


def _rows(archive: Archive, key: str, kinds: str, what: str) -> Array:
    """[rows, 3] of numbers of these kinds, at least one row."""
    array = parse_npy(archive.read(f"{key}.npy", MAX_ARRAY_BYTES), archive.path, key).read()
    if array.dtype.kind not in kinds or array.ndim != 2 or array.shape[1] != 3 or not len(array):
        raise AvatarError(
            f"expected {what} [rows, 3], got {array.dtype}{list(array.shape)}", file=archive.path, field=key
        )
    return array
