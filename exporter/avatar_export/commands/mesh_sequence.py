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
    """Vertices [V, 3] in metres of one mesh after another; .obj files are read when they are asked for."""

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
    """The meshes in one .npz (`vertices` [T, V, 3] or [V, 3]) or in .obj files, one a frame, in this order; of a
    folder in the order of their names.

    `units`: units of the files in a metre; by default the avatar's training units, since the training code poses
    its mesh in them. Raises AvatarError for an avatar that is bound to no surface, another number of vertices,
    other triangles, or a size that only other units explain; and where the joints turn the Gaussians too.
    """
    embedding = avatar.embedding
    if embedding is None:
        raise AvatarError("this avatar sits on no mesh; --meshes goes with binding surface", field="--meshes")
    if avatar.rules.rotation in RIGGED_ROTATIONS:
        raise AvatarError(
            f"rotation {avatar.rules.rotation} turns Gaussians by joints, which a mesh does not tell; play a clip",
            field="--meshes",
        )
    folder = paths[0]
    if len(paths) == 1 and folder.is_dir():
        paths = sorted(folder.glob("*.obj"))
        if not paths:
            raise AvatarError("holds no .obj file", file=folder, field="--meshes")
    if len(paths) == 1 and paths[0].suffix.lower() == ".npz":
        frames: Sequence[F32 | Path] = list(_npz_frames(paths[0], embedding))
    elif all(path.suffix.lower() == ".obj" for path in paths):
        frames = list(paths)
    else:
        raise AvatarError("name one .npz, or .obj files only", file=paths[0], field="--meshes")
    sequence = MeshSequence(embedding, frames, units or avatar.training_per_bundle)
    factor = _size(sequence[0]) / _size(embedding.canonical_vertices)
    if not 1 / PLAUSIBLE <= factor <= PLAUSIBLE:
        raise AvatarError(
            f"is {factor:.3g} times as large as the canonical mesh; say with --mesh-units how many of its units make a "
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
        message = f"holds a number that is not finite or beyond {FARTHEST:g}"
        raise AvatarError(message, file=path, field="vertices")
    return frames.astype(np.float32, copy=False)


def _obj_vertices(path: Path, embedding: Embedding) -> F32:
    mesh = read_obj(path)
    if len(mesh.vertices) != len(embedding.canonical_vertices):
        raise AvatarError(
            f"has {len(mesh.vertices)} vertices, the embedding's mesh has {len(embedding.canonical_vertices)}",
            file=path,
        )
    if _triangle_set(mesh.triangles) != _triangle_set(embedding.triangles):
        raise AvatarError(
            "has other triangles than the embedding's mesh: its vertices are renumbered", file=path
        )
    if not (np.abs(mesh.vertices) <= FARTHEST).all():
        raise AvatarError(f"holds a vertex beyond {FARTHEST:g}", file=path)
    return mesh.vertices


def _triangle_set(triangles: np.ndarray) -> bytes:
    """The same for the same triangles in any order, each starting at any corner."""
    first = np.argmin(triangles, axis=1)
    turned = np.take_along_axis(triangles, (first[:, None] + np.arange(3)) % 3, axis=1)
    return turned[np.lexsort(turned.T)].tobytes()


def _size(vertices: F32) -> float:
    """Root mean square distance from the middle: the same in every orientation."""
    return float(np.sqrt(((vertices - vertices.mean(axis=0)) ** 2).sum(axis=1).mean()))
