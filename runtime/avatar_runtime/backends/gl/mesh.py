"""The mesh on the GPU: stages morph and skin, and what stage bind makes of its triangles and vertices."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property

import moderngl
import numpy as np

from avatar_runtime.avatar import F32, Avatar, Rig
from avatar_runtime.backends.gl.gpu import Gpu
from avatar_runtime.backends.gl.layout import (
    FLOAT4,
    MESH_PLANES,
    TRIANGLE_PLANES,
    Heap,
    Run,
    morph_heap,
    skin_heap,
    surface_heap,
    vertex_runs,
)
from avatar_runtime.backends.gl.programs import Dispatch, Programs, Values
from avatar_runtime.stages.surface import Surface
from avatar_schema import constants

SIGNS = {"largest_positive": 0, "w_positive": 1, "largest_positive_mirrored": 2}


class Mesh:
    """The vertices of one avatar, posed. Buffers and kernels are made when first needed."""

    def __init__(
        self, gpu: Gpu, programs: Programs, avatar: Avatar, surface: Surface | None, pose: moderngl.Buffer, at: Values
    ) -> None:
        """`pose` is the Pose buffer, `at` where its sections begin."""
        self._gpu, self._programs, self._rig, self._surface = gpu, programs, avatar.rig, surface
        self._pose, self._at = pose, at
        if surface is not None:
            self.count = len(surface.embedding.canonical_vertices)
        else:
            self.count = 0 if avatar.rig is None else len(avatar.rig.vertices)

    def morph(self) -> None:
        """Stage morph."""
        self._run(self._morph)

    def skin(self) -> None:
        """Stage skin, in place."""
        self._run(self._skin)

    def turn(self) -> None:
        """First part of stage bind for Gaussians on a surface: triangles, then vertices."""
        for kernel in self._turn:
            self._run([kernel])

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
    def buffer(self) -> moderngl.Buffer:
        """Mesh."""
        return self._gpu.buffer(f"the mesh of {self.count} vertices", FLOAT4 * MESH_PLANES * self.count)

    @cached_property
    def triangles(self) -> moderngl.Buffer:
        """Triangles."""
        assert self._surface is not None
        count = len(self._surface.embedding.triangles)
        return self._gpu.buffer(f"the mesh of {count} triangles", FLOAT4 * TRIANGLE_PLANES * count)

    @cached_property
    def _morph(self) -> list[Dispatch]:
        return self._by_run("morph", morph_heap, "MorphStatic")

    @cached_property
    def _skin(self) -> list[Dispatch]:
        return self._by_run("skin", skin_heap, "SkinStatic")

    def _by_run(self, entry: str, pack: Callable[[Rig, Run], Heap], static: str) -> list[Dispatch]:
        rig = self._rig
        assert rig is not None
        made = []
        for run in vertex_runs(rig, self._gpu.limit):
            heap = pack(rig, run)
            buffers = {static: self._gpu.buffer(static, heap.words), "Pose": self._pose, "Mesh": self.buffer}
            values = {**heap.offsets, **self._at, "first": run.first, "count": run.count, "vertices": self.count}
            made.append(self._programs.dispatch(entry, run.count, buffers, values))
        return made

    @cached_property
    def _turn(self) -> list[Dispatch]:
        surface = self._surface
        assert surface is not None
        heap = surface_heap(surface)
        triangles, per_metre = len(surface.embedding.triangles), surface.training_per_bundle**2
        buffers = {
            "SurfaceStatic": self._gpu.buffer(f"the surface of {triangles} triangles", heap.words),
            "Mesh": self.buffer,
            "Triangles": self.triangles,
        }
        values = {
            **heap.offsets,
            "triangles": triangles,
            "vertices": self.count,
            "frame_by_edge": surface.rules.rotation == "triangle_frame",
            "quaternion_sign": SIGNS[surface.rules.quaternion_sign],
            "normal_floor": constants()["normal_floor"] / per_metre,
            "quaternion_floor": constants()["quaternion_floor"] / per_metre,
        }
        return [
            self._programs.dispatch("bind_triangles", triangles, buffers, values),
            self._programs.dispatch("bind_vertices", self.count, buffers, values),
        ]

    def _run(self, kernels: list[Dispatch]) -> None:
        for kernel in kernels:
            kernel.run()
        self._gpu.context.memory_barrier()
