"""Posed meshes from files, for Gaussians that are bound to a surface."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import overload

import numpy as np

from avatar_export.formats.archive import Archive
from avatar_export.formats.npy import parse_npy
from avatar_export.formats.obj import read_obj
from avatar_runtime.avatar import F32, Avatar, Embedding
from avatar_runtime.io.errors import AvatarError
from avatar_runtime.rules import RIGGED_ROTATIONS

MAX_ARRAY_BYTES = 2 << 30
FARTHEST = 1e9  # units from the origin
PLAUSIBLE = 1.6  # factor by which a posed mesh may be larger or smaller than the canonical one


class MeshSequence(Sequence[F32]):
    """Vertices [V, 3] in metres of each mesh in turn; .obj files are read on demand."""

    def __init__(self, embedding: Embedding, frames: Sequence[F32 | Path], units: float):
        self._embedding, self._frames, self._units = embedding, frames, np.float32(units)

    def __len__(self) -> int:
        return len(self._frames)

    @overload
    def __getitem__(self, index: int) -> F32: ...
    @overload
    def __getitem__(self, index: slice) -> MeshSequence: ...
    def __getitem__(self, index: int | slice) -> F32 | MeshSequence:
        if isinstance(index, slice):
            return MeshSequence(self._embedding, self._frames[index], float(self._units))
        frame = self._frames[index]
        vertices = _obj_vertices(frame, self._embedding) if isinstance(frame, Path) else frame
        return vertices / self._units


def read_meshes(avatar: Avatar, paths: Sequence[Path], units: float | None) -> MeshSequence:
    """The meshes of one .npz (`vertices` [T, V, 3] or [V, 3]), or of .obj files, one per frame.

    The .obj files of a folder are sorted by name.

    `units`: units of the files per metre; by default the avatar's training units, in which training code poses its
    mesh. Raises AvatarError for an avatar that is not bound to a surface or whose joints rotate Gaussians too, for
    another number of vertices, other triangles, and a size that only other units explain.
    """
    embedding = avatar.embedding
    if embedding is None:
        raise AvatarError(
            "this avatar is not bound to a surface; --meshes cannot be used with it", field="--meshes"
        )
    if avatar.rules.rotation in RIGGED_ROTATIONS:
        raise AvatarError(
            f"rotation {avatar.rules.rotation} rotates Gaussians by joints, which posed meshes lack; play a clip",
            field="--meshes",
        )
    folder = paths[0]
    if len(paths) == 1 and folder.is_dir():
        paths = sorted(folder.glob("*.obj"))
        if not paths:
            raise AvatarError("has no .obj file", file=folder, field="--meshes")
    if len(paths) == 1 and paths[0].suffix.lower() == ".npz":
        frames: Sequence[F32 | Path] = list(_npz_frames(paths[0], embedding))
    elif all(path.suffix.lower() == ".obj" for path in paths):
        frames = list(paths)
    else:
        raise AvatarError("pass one .npz, or only .obj files", file=paths[0], field="--meshes")
    sequence = MeshSequence(embedding, frames, units or avatar.training_per_bundle)
    factor = _size(sequence[0]) / _size(embedding.canonical_vertices)
    if not 1 / PLAUSIBLE <= factor <= PLAUSIBLE:
        raise AvatarError(
            f"is {factor:.3g} times as large as the canonical mesh; pass --mesh-units with the number of its units per "
            "metre",
            file=paths[0],
        )
    return sequence


def _npz_frames(path: Path, embedding: Embedding) -> F32:
    with Archive(path) as archive:
        stored = parse_npy(archive.read("vertices.npy", MAX_ARRAY_BYTES), path, "vertices").read()
    want = embedding.canonical_vertices.shape
    frames = stored[None] if stored.ndim == 2 else stored
    if frames.dtype.kind != "f" or frames.ndim != 3 or frames.shape[1:] != want or not len(frames):
        raise AvatarError(
            f"is {stored.dtype}{list(stored.shape)}, expected floats [frames, {want[0]}, 3]",
            file=path,
            field="vertices",
        )
    if not (np.abs(frames) <= FARTHEST).all():
        message = f"has a value that is not finite, or larger than {FARTHEST:g}"
        raise AvatarError(message, file=path, field="vertices")
    return frames.astype(np.float32, copy=False)


def _obj_vertices(path: Path, embedding: Embedding) -> F32:
    mesh = read_obj(path)
    if len(mesh.vertices) != len(embedding.canonical_vertices):
        raise AvatarError(
            f"has {len(mesh.vertices)} vertices, but the embedding's mesh has {len(embedding.canonical_vertices)}",
            file=path,
        )
    if _triangle_set(mesh.triangles) != _triangle_set(embedding.triangles):
        raise AvatarError(
            "has other triangles than the embedding's mesh; export it with unchanged vertex order", file=path
        )
    if not (np.abs(mesh.vertices) <= FARTHEST).all():
        raise AvatarError(f"has a coordinate larger than {FARTHEST:g}", file=path)
    return mesh.vertices


def _triangle_set(triangles: np.ndarray) -> bytes:
    """Bytes that are equal for equal triangles in any order, each starting at any corner."""
    first = np.argmin(triangles, axis=1)
    turned = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return turned[np.lexsort(turned.T)].tobytes()


def _size(vertices: F32) -> float:
    """Root mean square distance from the centre, which does not depend on the orientation."""
    return float(np.sqrt(((vertices - vertices.mean(axis=0)) ** 2).sum(axis=1).mean()))
