"""Do Gaussians move as the triangles under them do: with expressions, eyelids, pose features and joints?"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.fit.closest import Nearest
from avatar_export.fit.surface import FEWEST, Mesh, opaque_rows
from avatar_runtime.avatar import F64, I64, Avatar, Group, SparseRows

LEAST_MOTION = 1e-3  # metres; smaller motions of the mesh are not compared
LIKE = 0.5  # correlation below which the motions have nothing to do with each other
GAIN = (0.4, 2.5)  # of the Gaussians' motion over the mesh's
FEWEST_MOVED = 20  # pairs of a Gaussian and a column
WEIGHTS = 0.25  # mean share of the skin weights that goes to other joints
LID_ROWS = 300


@dataclass(frozen=True)
class Motion:
    """How the motions [M, 3] of Gaussians compare with those of the mesh at the same places."""

    moved: int  # M
    correlation: float
    gain: float  # least squares: the Gaussians' motion is about gain times the mesh's

    @property
    def alike(self) -> bool:
        """Whether nothing speaks against one motion; so it is where too little moves."""
        close = self.correlation >= LIKE and GAIN[0] <= self.gain <= GAIN[1]
        return self.moved < FEWEST_MOVED or close


@dataclass(frozen=True)
class Under:
    """A sample of Gaussians and the places of the mesh under them."""

    rows: I64  # [N] of the avatar
    corners: I64  # [N, 3] vertices
    barycentric: F64  # [N, 3]

    @staticmethod
    def of(rows: I64, mesh: Mesh, nearest: Nearest) -> Under:
        """From the nearest points of the mesh to the Gaussians `rows`."""
        return Under(rows, mesh.triangles[nearest.triangle].astype(np.int64), nearest.barycentric)

    def of_mesh(self, table: SparseRows, name: str) -> F64:
        """[N, columns, ...] the values `name` of a table of vertices, at these places."""
        total = sum(self.barycentric[:, k] * dense(table, self.corners[:, k], name).T for k in range(3))
        result: F64 = np.asarray(total).T
        return result


def _entries(table: SparseRows) -> I64:
    """[R] the number of entries of each row."""
    ends: I64 = table.row_ptr.astype(np.int64)
    return ends[1:] - ends[:-1]


def dense(table: SparseRows, rows: I64, name: str) -> F64:
    """[N, columns, ...] the values `name` of some rows, zeros included."""
    part = table.take(rows)
    result: F64 = np.zeros((len(rows), table.columns, *part.values[name].shape[1:]))
    result[np.repeat(np.arange(len(rows)), _entries(part)), part.column] = part.values[name]
    return result


def compared(own: F64, mesh: F64) -> Motion:
    """The motions [N, K, 3] of Gaussians against those of the mesh, where the latter move enough."""
    moved = np.linalg.norm(mesh, axis=2) > LEAST_MOTION
    moved[:, ~own.any(axis=(0, 2))] = False  # columns that the checkpoint does not have
    x, y = own[moved], mesh[moved]
    both, ours, theirs = float((x * y).sum()), float((x * x).sum()), float((y * y).sum())
    if not len(x):
        return Motion(0, 1.0, 1.0)
    return Motion(len(x), both / max(np.sqrt(ours * theirs), 1e-30), both / max(theirs, 1e-30))


def expressions(avatar: Avatar, under: Under) -> tuple[Motion, F64, F64]:
    """(all expressions together, motions [N, K, 3] of the Gaussians, of the mesh)."""
    assert avatar.rig is not None
    own = dense(avatar.blendshapes.geometry, under.rows, "mean")
    mesh = under.of_mesh(avatar.rig.morphs, "position")
    return compared(own, mesh), own, mesh


def _alike(own: F64, mesh: F64) -> F64:
    """[K, K] correlation of each column of the Gaussians with each of the mesh."""
    flat = (np.moveaxis(m, 1, 0).reshape(m.shape[1], -1) for m in (own, mesh))
    a, b = (m / np.maximum(np.linalg.norm(m, axis=1, keepdims=True), 1e-30) for m in flat)
    alike: F64 = a @ b.T
    return alike


def best_column(own: F64, mesh: F64) -> tuple[int, int] | None:
    """(column of the Gaussians, column of the mesh that moves like it), for the largest motion whose own column of the
    mesh does not; None if no column does."""
    alike = _alike(own, mesh)
    for column in np.argsort(-np.linalg.norm(own, axis=(0, 2)), kind="stable").tolist():
        best = int(np.argmax(alike[column]))
        if best != column and alike[column, best] > 0.9:
            return column, best
    return None


def exchanged_columns(own: F64, mesh: F64) -> list[tuple[int, int]]:
    """(column of the Gaussians, column of the mesh) wherever another column of the mesh moves as it does, and its own
    does not: a few exchanged columns leave all together alike."""
    moved = (np.linalg.norm(mesh, axis=2) > LEAST_MOTION / 4).sum(axis=0) >= FEWEST_MOVED
    alike = np.where(moved & moved[:, None], _alike(own, mesh), 0)
    best = alike.argmax(axis=1)
    own_alike, most = alike.diagonal(), alike.max(axis=1)
    wrong = moved & own.any(axis=(0, 2)) & (most >= LIKE) & (own_alike < most - LIKE)
    return [(k, int(best[k])) for k in np.flatnonzero(wrong).tolist()]


def joints_shared(avatar: Avatar, under: Under) -> float:
    """The mean share (0..1) of the Gaussians' skin weights that goes to other joints than the mesh's under them."""
    assert avatar.rig is not None
    own = dense(avatar.skin, under.rows, "weight")
    return float(np.abs(own - under.of_mesh(avatar.rig.skin, "weight")).sum(axis=1).mean() / 2)


def features(avatar: Avatar, under: Under) -> Motion:
    """The pose correctives. Their gain is no sign: the released Gaussian Blendshapes code adds three corners."""
    assert avatar.rig is not None
    own = dense(avatar.blendshapes.correctives, under.rows, "mean")
    found = compared(own, under.of_mesh(avatar.rig.correctives, "position"))
    return Motion(found.moved, found.correlation, 1.0)


def eyelids(avatar: Avatar, group: Group, mesh: Mesh) -> Motion:
    """The late morphs of a group, in the neighbourhood of the vertices that they move."""
    assert avatar.rig is not None
    late = avatar.rig.late_morphs
    vertex = np.repeat(np.arange(late.rows), _entries(late))
    moved = np.unique(vertex[np.linalg.norm(late.values["position"], axis=1) > LEAST_MOTION])
    rows = opaque_rows(avatar, group, group.count)
    points = avatar.gaussians.mean[rows].astype(np.float64)
    if not len(moved):
        return Motion(0, 1.0, 1.0)
    low, high = mesh.vertices[moved].min(axis=0), mesh.vertices[moved].max(axis=0)
    rows = rows[((points >= low) & (points <= high)).all(axis=1)]
    rows = rows[np.unique(np.linspace(0, len(rows) - 1, min(LID_ROWS, len(rows))).astype(np.int64))]
    if len(rows) < FEWEST:
        return Motion(0, 1.0, 1.0)
    under = Under.of(rows, mesh, mesh.nearest(avatar.gaussians.mean[rows].astype(np.float64)))
    return compared(dense(avatar.blendshapes.late_morphs, rows, "mean"), under.of_mesh(late, "position"))
