"""The mesh on the GPU: stages morph and skin, and how its triangles and vertices turn, for stage bind."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from functools import cached_property

import moderngl
import numpy as np

from avatar_runtime.avatar import F32, Avatar, Rig, SparseRows
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.layout import (
    FLOAT4,
    MESH_PLANES,
    RIGGED_MESH_PLANES,
    TRIANGLE_PLANES,
    PackedBuffer,
    Run,
    pack_morph,
    pack_skin,
    pack_surface,
    vertex_runs,
)
from avatar_runtime.backends.gl.programs import Dispatch, Programs, Values
from avatar_runtime.rules import RIGGED_ROTATIONS, code
from avatar_runtime.stages.surface import Surface
from avatar_schema import constants


class Mesh:
    """The vertices of one avatar, posed. Buffers and kernels are made when first asked for."""

    def __init__(
        self, gpu: Gpu, programs: Programs, avatar: Avatar, count: int, pose: moderngl.Buffer, at: Values
    ) -> None:
        """`count` vertices; `pose` is the Pose buffer, `at` where its sections begin."""
        self.count, self.pose, self.at = count, pose, at
        self._gpu, self._programs, self._rig = gpu, programs, avatar.rig
        self._planes = RIGGED_MESH_PLANES if avatar.rules.rotation in RIGGED_ROTATIONS else MESH_PLANES

    @cached_property
    def buffer(self) -> moderngl.Buffer:
        """Mesh. Raises AvatarError if it exceeds the limit."""
        return self._gpu.buffer(f"the mesh of {self.count} vertices", FLOAT4 * self._planes * self.count)

    def morph(self) -> None:
        """Stage morph."""
        run_all(self._gpu, self._morph)

    def skin(self) -> None:
        """Stage skin, in place."""
        run_all(self._gpu, self._skin)

    def upload(self, vertices: F32) -> None:
        """Positions [V, 3] in place of those that the rig makes."""
        plane = np.ones((self.count, 4), np.float32)
        plane[:, :3] = vertices
        self.buffer.write(plane.tobytes())

    def download(self) -> F32:
        """Positions [V, 3]."""
        plane = np.frombuffer(self.buffer.read(FLOAT4 * self.count), np.float32)
        return plane.reshape(self.count, 4)[:, :3].copy()

    @cached_property
    def _morph(self) -> list[Dispatch]:
        return self._by_run("morph", pack_morph, "MorphStatic")

    @cached_property
    def _skin(self) -> list[Dispatch]:
        return self._by_run("skin", pack_skin, "SkinStatic")

    def _by_run(self, entry: str, pack: Callable[[Rig, Run], PackedBuffer], static: str) -> list[Dispatch]:
        rig = self._rig
        assert rig is not None
        made = []
        for run in vertex_runs(rig, self._gpu.limit):
            packed = pack(rig, run)
            buffers = {static: self._gpu.buffer(static, packed.words), "Pose": self.pose, "Mesh": self.buffer}
            rows = {"first": run.first, "count": run.count, "vertices": self.count}
            made.append(
                self._programs.dispatch(entry, run.count, buffers, {**packed.offsets, **self.at, **rows})
            )
        return made


class Turns:
    """How the triangles and vertices under the Gaussians have turned: the first steps of stage bind."""

    def __init__(self, gpu: Gpu, programs: Programs, surface: Surface, mesh: Mesh, skin: SparseRows) -> None:
        """Raises AvatarError for a mesh that exceeds the limit: it cannot be split. `skin` as `pack_surface` has it."""
        self._gpu = gpu
        packed, count = pack_surface(surface, skin), len(surface.embedding.triangles)
        what, area = f"the surface of {count} triangles", surface.training_per_bundle**2
        self.triangles = gpu.buffer(what, FLOAT4 * TRIANGLE_PLANES * count)
        buffers = {
            "SurfaceStatic": gpu.buffer(what, packed.words),
            "Mesh": mesh.buffer,
            "Triangles": self.triangles,
            "Pose": mesh.pose,
        }
        values = {
            **mesh.at,
            **packed.offsets,
            "triangles": count,
            "vertices": mesh.count,
            "rotation_rule": code("rotation", surface.rules.rotation),
            "quaternion_sign": code("quaternion_sign", surface.rules.quaternion_sign),
            "normal_floor": constants()["normal_floor"] / area,
            "quaternion_floor": constants()["quaternion_floor"] / area,
        }
        self._by_triangle = programs.dispatch("bind_triangles", count, buffers, values)
        self._by_vertex = programs.dispatch("bind_vertices", mesh.count, buffers, values)

    def run(self) -> None:
        """Triangles, then vertices."""
        run_all(self._gpu, [self._by_triangle])
        run_all(self._gpu, [self._by_vertex])


def run_all(gpu: Gpu, kernels: Iterable[Dispatch]) -> None:
    """Kernels that do not read each other's results, and a barrier for later kernels that read them."""
    for kernel in kernels:
        kernel.run()
    gpu.context.memory_barrier()
