"""psavatar.npz: the binding of PSAvatar's Gaussians to their mesh, and the learned bases that move the mesh.

The layout is described in schema/PSAVATAR.md.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.formats.archive import Archive
from avatar_export.formats.mesh_files import MAX_ARRAY_BYTES
from avatar_export.formats.npy import parse_npy, parse_text_npy
from avatar_export.formats.obj import TriangleMesh
from avatar_export.formats.point_cloud import PointCloud
from avatar_export.notes.note import Note
from avatar_export.readers import surface
from avatar_runtime.avatar import F32, U32
from avatar_runtime.io.errors import AvatarError

FILE = "psavatar.npz"
KEYS = (
    *("canonical_vertices", "triangles", "triangle", "barycentric", "displacement", "local_quat_wxyz"),
    *("basis", "basis_names", "training_per_metre"),
)
MAX_LOOKED_AT = 16  # .npz files beside a .ply
MAX_NAMES_BYTES = 1 << 24
LARGEST_SHIFT = 1.0  # metres; largest shift of a vertex by one basis vector
LARGEST = 1e4  # of any number (metres, training units per metre, quaternions)

Array = npt.NDArray[Any]


@dataclass(frozen=True)
class StoredPoints:
    """The checked content of psavatar.npz, in metres."""

    file: Path
    mesh: TriangleMesh  # at rest
    triangle: U32  # [N]
    barycentric: F32  # [N, 3]
    displacement: F32  # [N]
    local_quat_wxyz: F32  # [N, 4]
    basis: F32  # [U, V, 3]
    basis_names: tuple[str, ...]  # [U]
    training_per_metre: float
    notes: tuple[Note, ...]


def find_points(cloud: PointCloud) -> Path | None:
    """The .npz of any name beside the .ply that has all of KEYS, or None; never raises."""
    try:
        beside = sorted(path for path in cloud.file.parent.iterdir() if path.suffix.lower() == ".npz")
    except OSError:
        return None
    return next((path for path in beside[:MAX_LOOKED_AT] if _holds_keys(path)), None)


def read_points(path: Path, count: int) -> StoredPoints:
    """The content of the .npz at `path` for `count` Gaussians. Raises AvatarError for a missing or unsound array."""
    with Archive(path) as archive:
        file = _File(archive)
        vertices = file.floats("canonical_vertices", (None, 3))
        triangles = file.whole("triangles", (None, 3), len(vertices), "vertices").astype(np.uint32)
        mesh = TriangleMesh(vertices, triangles)
        triangle = file.whole("triangle", (count,), len(triangles), "triangles").astype(np.uint32)
        barycentric = file.floats("barycentric", (count, 3))
        basis = file.floats("basis", (None, len(vertices), 3))
        names = file.names("basis_names", len(basis))
        notes = surface.check_barycentric(barycentric, path, "barycentric")
        surface.check_areas(mesh, triangle, path)
        if len(basis) and np.abs(basis).max() > LARGEST_SHIFT:
            at = int(np.argmax(np.abs(basis).reshape(len(basis), -1).max(axis=1)))
            raise AvatarError(
                f"moves a vertex by more than {LARGEST_SHIFT:g} m; bases are in metres",
                file=path,
                field=f"basis[{at}] ({names[at]})",
            )
        return StoredPoints(
            path,
            mesh,
            triangle,
            barycentric,
            file.floats("displacement", (count,)),
            file.floats("local_quat_wxyz", (count, 4)),
            basis,
            names,
            surface.units_of(float(file.floats("training_per_metre", (1,))[0])),
            tuple(notes),
        )


def _holds_keys(path: Path) -> bool:
    try:
        with Archive(path) as archive:
            return {f"{key}.npy" for key in KEYS} <= set(archive.names)
    except AvatarError:
        return False


class _File:
    """The arrays of the .npz, each checked for a type and shape."""

    def __init__(self, archive: Archive) -> None:
        self._archive = archive

    def floats(self, key: str, shape: tuple[int | None, ...]) -> F32:
        """A float32 array with magnitudes up to LARGEST."""
        array = self._array(key, shape, "f", "floats")
        with np.errstate(over="ignore"):
            values: F32 = array.astype(np.float32)
        sound = (np.abs(values) <= LARGEST).all(axis=tuple(range(1, values.ndim)))  # False for NaN
        if not sound.all():
            raise self._wrong(
                f"is not finite, or larger than {LARGEST:g}; lengths are in metres",
                f"{key}[{int(np.argmin(sound))}]",
            )
        return values

    def whole(self, key: str, shape: tuple[int | None, ...], end: int, what: str) -> Array:
        """An array of whole numbers 0 <= v < end, which number `what`."""
        array = self._array(key, shape, "iu", "whole numbers")
        outside = ((array < 0) | (array >= end)).any(axis=tuple(range(1, array.ndim)))
        if outside.any():
            at = int(np.argmax(outside))
            raise self._wrong(f"is {array[at].tolist()}, but there are {end} {what}", f"{key}[{at}]")
        return array

    def names(self, key: str, count: int) -> tuple[str, ...]:
        """`count` different strings."""
        if not count:
            return ()
        found = parse_text_npy(self._archive.read(f"{key}.npy", MAX_NAMES_BYTES), self._archive.path, key)
        if len(found) != count or len(set(found)) != count:
            raise self._wrong(f"has {len(found)} names, expected {count} different names", key)
        return found

    def _array(self, key: str, shape: tuple[int | None, ...], kinds: str, what: str) -> Array:
        stored = parse_npy(self._archive.read(f"{key}.npy", MAX_ARRAY_BYTES), self._archive.path, key)
        fits = len(stored.shape) == len(shape) and all(
            wanted is None or size == wanted for size, wanted in zip(stored.shape, shape, strict=True)
        )
        if stored.dtype.kind not in kinds or not fits:
            expected = ", ".join("rows" if size is None else str(size) for size in shape)
            raise self._wrong(f"expected {what} [{expected}], got {stored.dtype}{list(stored.shape)}", key)
        return stored.read()

    def _wrong(self, message: str, field: str) -> AvatarError:
        return AvatarError(message, file=self._archive.path, field=field)
