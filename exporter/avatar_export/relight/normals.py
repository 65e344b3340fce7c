"""Which way each Gaussian faces: as the nearest point of the mesh does, or as its own shape where no mesh is near."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_export.fit.closest import Triangles
from avatar_export.levels.views import fitting_poses
from avatar_export.ops.normals import axes, unit
from avatar_runtime.avatar import F64, I64, U32, Avatar
from avatar_runtime.light import turned
from avatar_runtime.player import Player
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.light import axes_by_mesh
from avatar_runtime.stages.surface import prepare

FAR = 0.05  # metres from the mesh: farther Gaussians face as their own shape does
POSES = 16
AWAY = -0.1  # cosine from which on a Gaussian faces away from who sees it; a rim is seen from a little behind


def own_normals(avatar: Avatar, towards: F64) -> F64:
    """[N, 3] unit normals in the axes of each Gaussian; `towards` [N, 3] are the mean directions to who sees it, there.

    The mean over poses of the normal of the mesh at the point that is nearest in the binding pose: the Gaussian turns
    with it, but not always as far. What then faces away from who sees it is of another sheet than the nearest one: a
    tooth behind a lip, an eye behind a lid, what shines through a skin that is not quite closed. It faces the viewers.
    """
    found = _of_mesh(avatar)
    return np.where((np.sum(found * towards, axis=1) < AWAY)[:, None], unit(towards), found)


def _of_mesh(avatar: Avatar) -> F64:
    shape = np.einsum("nji,nj->ni", axes(avatar), _of_shape(avatar))
    under = _under(avatar)
    if under is None:
        return unit(shape)
    total = np.zeros((avatar.gaussians.count, 3))
    if avatar.rig is None:
        total = np.einsum("nji,nj->ni", axes(avatar), under.normals(under.vertices))
    else:
        player, surface = Player(avatar), None
        if avatar.embedding is not None and turned(avatar):
            surface = prepare(avatar.embedding, avatar.rules, avatar.training_per_bundle)
        for pose in fitting_poses(avatar, POSES):
            mesh = player.mesh(pose)
            if surface is not None:
                turn = axes_by_mesh(surface, mesh)
            else:
                turn = matrix_from_quat(player.animate(pose).quat_wxyz.astype(np.float64))
            total += np.einsum("nji,nj->ni", turn, under.normals(mesh.astype(np.float64)))
    return unit(np.where(under.near[:, None], total, shape))


@dataclass(frozen=True)
class _Under:
    """The point of a mesh that is nearest to each Gaussian in the binding pose."""

    vertices: F64  # [V, 3]
    triangles: U32
    corners: I64  # [N, 3] vertices
    barycentric: F64  # [N, 3]
    near: np.ndarray

    def normals(self, vertices: F64) -> F64:
        """[N, 3] unit normals there, of the mesh with posed `vertices`."""
        smooth = vertex_normals(vertices, self.triangles)
        return unit(np.einsum("nc,ncx->nx", self.barycentric, smooth[self.corners]))


def _under(avatar: Avatar) -> _Under | None:
    mesh = (avatar.embedding.canonical_vertices, avatar.embedding.triangles) if avatar.embedding else None
    if mesh is None and avatar.rig is not None:
        mesh = avatar.rig.vertices, avatar.rig.triangles
    if mesh is None or not len(mesh[1]):
        return None
    vertices, triangles = mesh[0].astype(np.float64), mesh[1]
    nearest = Triangles.of(vertices, triangles).nearest(avatar.gaussians.mean.astype(np.float64))
    corners = triangles[nearest.triangle].astype(np.int64)
    return _Under(vertices, triangles, corners, nearest.barycentric, nearest.distance < FAR)


def vertex_normals(vertices: F64, triangles: U32) -> F64:
    """[V, 3] unit normals, triangles weighted by area."""
    corner = vertices[triangles.astype(np.int64)]
    across = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    total = np.zeros_like(vertices)
    for k in range(3):
        np.add.at(total, triangles[:, k].astype(np.int64), across)
    return unit(total)


def _of_shape(avatar: Avatar) -> F64:
    """The thinnest axis of each Gaussian, away from the middle of all."""
    mean = avatar.gaussians.mean.astype(np.float64)
    thin = avatar.gaussians.log_scale.argmin(axis=1)
    axis = np.take_along_axis(axes(avatar), thin[:, None, None], axis=2)[:, :, 0]
    outwards = np.sum(axis * (mean - np.median(mean, axis=0)), axis=1)
    return unit(np.where(outwards[:, None] < 0, -axis, axis))
