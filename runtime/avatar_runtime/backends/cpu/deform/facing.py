"""First step of stage `light` of the `cpu` backend where normals turn with the triangles of the mesh."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64, U32, Avatar
from avatar_runtime.backends.cpu.arrays import read_only
from avatar_runtime.backends.cpu.deform.surface import Vector, cross, unit
from avatar_runtime.backends.cpu.jit import inlined, kernel
from avatar_runtime.stages.light import axes_by_mesh
from avatar_runtime.stages.surface import prepare


class Facing:
    """What no pose changes of the normals of one avatar."""

    def __init__(self, avatar: Avatar) -> None:
        e, relight = avatar.embedding, avatar.relight
        assert e is not None and relight is not None
        surface = prepare(e, avatar.rules, avatar.training_per_bundle)
        normal = np.einsum("nij,nj->ni", axes_by_mesh(surface, e.canonical_vertices), relight.normal)
        frame = surface.canonical.frame[e.triangle]
        # In the axes of the triangle, and the triangle's corners.
        self._own = read_only(np.einsum("nji,nj->ni", frame, normal), np.float64)
        self._corners = read_only(e.triangles[e.triangle], np.uint32)
        self.quat_wxyz: F32 = np.tile(np.array([1, 0, 0, 0], np.float32), (len(normal), 1))

    def normals(self, vertices: F32, world_from_avatar: F64) -> F32:
        """[N, 3] in the world, on the posed `vertices` [V, 3]. `quat_wxyz` of this class turns them no further."""
        out = np.empty(self._own.shape, np.float32)
        turn_normals(
            self._own,
            self._corners,
            read_only(vertices),
            read_only(world_from_avatar[:3, :3], np.float64),
            out,
        )
        return out


@kernel()
def turn_normals(own: F64, corners: U32, vertices: F32, world: F64, out: F32) -> None:
    """The axes of a triangle are those of `triangle_turns`."""
    for i in range(len(own)):
        p = point(vertices, corners[i, 0])
        e = between(p, point(vertices, corners[i, 1]))
        x = unit(cross(e, unit(cross(e, between(p, point(vertices, corners[i, 2]))))))
        y, z = unit(cross(e, x)), unit(e)
        a, b, c = own[i, 0], own[i, 1], own[i, 2]
        n = (a * x[0] + b * y[0] + c * z[0], a * x[1] + b * y[1] + c * z[1], a * x[2] + b * y[2] + c * z[2])
        for k in range(3):
            out[i, k] = world[k, 0] * n[0] + world[k, 1] * n[1] + world[k, 2] * n[2]


@inlined
def point(vertices: F32, at: int) -> Vector:
    """A row in float64."""
    return np.float64(vertices[at, 0]), np.float64(vertices[at, 1]), np.float64(vertices[at, 2])


@inlined
def between(a: Vector, b: Vector) -> Vector:
    """b - a."""
    return b[0] - a[0], b[1] - a[1], b[2] - a[2]
