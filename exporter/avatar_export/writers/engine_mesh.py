"""The rig's mesh for game engines: without the parts that importers drop, so that they do not renumber it.

Importers drop vertices that no triangle uses, degenerate triangles and duplicate triangles (Blender's `mesh.validate`,
Godot). A mesh without these keeps its numbering in importers that do not optimise.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from avatar_export.writers.fewer_joints import few
from avatar_export.writers.rig_poses import fitted_poses
from avatar_runtime.avatar import F32, F64, I64, U16, U32, Avatar, SparseRows
from avatar_runtime.engine_pose import target_names
from avatar_runtime.io.errors import AvatarError

FEWEST = 4  # joints a vertex that every engine shows


@dataclass(frozen=True)
class Target:
    """A morph target: the offsets that a weight of 1 adds before skinning. Vertices that do not move are left out."""

    name: str
    rows: I64  # [n] vertices of the EngineMesh, increasing
    offsets: F32  # [n, 3] metres


@dataclass(frozen=True)
class Influences:
    """The n joints of each vertex in an engine."""

    joints: U16  # [v, n] strongest first, ties by joint; 0 where the weight is 0
    weights: F32  # [v, n] not negative, rows add up to 1
    truncated: F64  # [v] fraction of the vertex's weight that other joints had


@dataclass(frozen=True)
class EngineMesh:
    """The rig's mesh at rest, without parts that importers drop. Corners and triangles are in the rig's order."""

    vertex_id: I64  # [v] row in rig.safetensors, increasing
    vertices: F32  # [v, 3] metres
    normals: F32  # [v, 3] unit, weighted by area
    triangles: U32  # [f, 3] rows of `vertices`
    targets: tuple[Target, ...]  # [M] in the order of engine_pose.target_names
    skin: SparseRows  # [v] all influences
    fitted_poses: F64 | None  # [P, J, 4, 4] skin matrices, if a vertex has more than FEWEST joints

    def influences(self, most: int) -> Influences:
        """`most` joints of each vertex; weights add up to 1.

        Vertices with more joints get those that fit the poses best (`fewer_joints`); without `fitted_poses` the
        strongest, scaled.
        A vertex without a positive weight gets joint 0. Raises ValueError unless `most` is 4 or 8.
        """
        found = self._strongest(most)
        full = found.truncated > 0
        if self.fitted_poses is None or not full.any():
            return found
        rows = np.flatnonzero(full)
        joints, weights = _padded(self.skin.take(rows))
        joints, weights = few(self.vertices[rows], joints, weights, self.fitted_poses, most)
        found.joints[rows] = np.where(weights > 0, joints, 0)
        found.weights[rows] = weights
        return found

    def _strongest(self, most: int) -> Influences:
        if most not in (4, 8):
            raise ValueError(f"influences must be 4 or 8, not {most}")
        row = entry_rows(self.skin)
        weight = np.maximum(self.skin.values["weight"].astype(np.float64), 0)
        order = np.lexsort((self.skin.column, -weight, row))
        rank = np.arange(len(row)) - self.skin.row_ptr[row]
        kept = rank < most
        at = row[kept], rank[kept]
        joints, weights = np.zeros((self.skin.rows, most), np.uint16), np.zeros((self.skin.rows, most))
        joints[at], weights[at] = self.skin.column[order][kept], weight[order][kept]
        total, shown = np.bincount(row, weight, self.skin.rows), weights.sum(axis=1)
        nowhere = shown <= 0
        joints[nowhere, 0], weights[nowhere, 0], shown[nowhere] = 0, 1, 1
        scaled = (weights / shown[:, None]).astype(np.float32)
        return Influences(
            np.where(scaled > 0, joints, 0).astype(np.uint16),
            scaled,
            np.where(total > 0, 1 - shown / np.where(total > 0, total, 1), 0),
        )


def engine_mesh(avatar: Avatar) -> EngineMesh:
    """The rig's mesh for engines; it may be empty. Raises AvatarError without a rig.

    Left out: triangles with a repeated corner or no area at rest, all but the first of triangles with the same
    three corners in any order (importers ignore the winding), and vertices that then have none.
    """
    rig = avatar.rig
    if rig is None:
        raise AvatarError("this avatar has no rig, so engines have no mesh of it", field="rig")
    triangle_id = _sound_triangles(rig.vertices, rig.triangles)
    vertex_id, corners = np.unique(rig.triangles[triangle_id], return_inverse=True)
    vertices, triangles = rig.vertices[vertex_id], corners.reshape(-1, 3).astype(np.uint32)
    columns = [
        column
        for matrix in (rig.morphs, rig.correctives, rig.late_morphs)
        for column in _columns(matrix.take(vertex_id))
    ]
    return EngineMesh(
        vertex_id.astype(np.int64),
        vertices,
        _normals(vertices, triangles),
        triangles,
        tuple(Target(name, *column) for name, column in zip(target_names(avatar), columns, strict=True)),
        rig.skin.take(vertex_id),
        fitted_poses(avatar, rig) if _most_joints(rig.skin) > FEWEST else None,
    )


def _most_joints(skin: SparseRows) -> int:
    """The joints of the vertex that has the most."""
    return int(np.diff(skin.row_ptr.astype(np.int64)).max(initial=0))


def _padded(skin: SparseRows) -> tuple[I64, F64]:
    """(joints [v, n], weights [v, n]) strongest first, ties by joint; weights add up to 1; unused places are 0."""
    row = entry_rows(skin)
    weight = np.maximum(skin.values["weight"].astype(np.float64), 0)
    order = np.lexsort((skin.column, -weight, row))
    rank = np.arange(len(row)) - skin.row_ptr[row]
    shape = skin.rows, _most_joints(skin)
    joints, weights = np.zeros(shape, np.int64), np.zeros(shape)
    joints[row, rank], weights[row, rank] = skin.column[order], weight[order]
    return joints, weights / weights.sum(axis=1, keepdims=True)


def _sound_triangles(vertices: F32, triangles: U32) -> I64:
    """Rows of the triangles with an area whose three corners no earlier triangle has."""
    area = np.linalg.norm(_area_vectors(vertices, triangles), axis=1) > 0
    sound = np.flatnonzero(area)
    _, first = np.unique(np.sort(triangles[sound], axis=1), axis=0, return_index=True)
    result: I64 = np.sort(sound[first]).astype(np.int64)
    return result


def _area_vectors(vertices: F32, triangles: U32) -> F64:
    """[F, 3]: vectors along the triangles' normals, with twice the area as length."""
    a, b, c = np.moveaxis(vertices[triangles].astype(np.float64), 1, 0)
    result: F64 = np.cross(b - a, c - a)
    return result


def _normals(vertices: F32, triangles: U32) -> F32:
    """Unit vertex normals; where those of the triangles cancel, the normal of the vertex's last triangle."""
    area = _area_vectors(vertices, triangles)
    total, one = np.zeros(vertices.shape), np.zeros(vertices.shape)
    for corner in range(3):
        for axis in range(3):
            total[:, axis] += np.bincount(triangles[:, corner], area[:, axis], len(vertices))
    one[triangles] = area[:, None]
    cancelled = np.abs(total).max(axis=1) <= 1e-6 * np.abs(one).max(axis=1)
    total[cancelled] = one[cancelled]
    normals: F32 = (total / np.linalg.norm(total, axis=1, keepdims=True)).astype(np.float32)
    return normals


def entry_rows(matrix: SparseRows) -> I64:
    """[E]: the row of every entry."""
    ptr = matrix.row_ptr.astype(np.int64)
    return np.repeat(np.arange(matrix.rows, dtype=np.int64), ptr[1:] - ptr[:-1])


def _columns(matrix: SparseRows) -> list[tuple[I64, F32]]:
    """(rows, position [n, 3]) of every column, without zeros."""
    position, row = matrix.values["position"], entry_rows(matrix)
    entry = np.flatnonzero(position.any(axis=1))
    entry = entry[np.argsort(matrix.column[entry], kind="stable")]
    ends = np.searchsorted(matrix.column[entry], np.arange(matrix.columns + 1))
    return [(row[entry[a:b]], position[entry[a:b]]) for a, b in pairwise(ends)]


def vertex_id_uv(vertex_id: I64) -> F32:
    """[v, 2] float32: rows of rig.safetensors as a UV set that half floats hold exactly."""
    return np.stack([vertex_id % 256, 2 + vertex_id // 256], axis=1).astype(np.float32)
