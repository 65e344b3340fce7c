"""The two kinds of binding, one class each: Gaussians follow joints and groups, or they are embedded in a mesh."""

from __future__ import annotations

import threading
from typing import Protocol

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends.cpu.arrays import (
    Base,
    Blendable,
    EmbeddedRules,
    Influences,
    Out,
    PosedArrays,
    Sizes,
    read_only,
)
from avatar_runtime.backends.cpu.deform import inputs
from avatar_runtime.backends.cpu.deform.embedded import animate_embedded, bind_embedded
from avatar_runtime.backends.cpu.deform.mesh import vertex_matrices
from avatar_runtime.backends.cpu.deform.skinned import animate_skinned, bind_skinned
from avatar_runtime.backends.cpu.deform.surface import triangle_turns, vertex_sums
from avatar_runtime.backends.cpu.workers import share
from avatar_runtime.rules import RIGGED_ROTATIONS, code
from avatar_runtime.stages.surface import prepare
from avatar_schema import constants


class Binding(Protocol):
    """Stages blend, bind and activate of one avatar."""

    def animate(self, posed: PosedArrays, vertices: F32 | None, out: Out, threads: int) -> None:
        """Writes the splats of a frame into `out`; its `touched` says what the previous frame changed there."""
        ...

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        """Stage `bind` alone; its log scale in `scale`."""
        ...


class SkinnedBinding:
    """Gaussians that follow joints and groups."""

    def __init__(self, avatar: Avatar, blendable: Blendable) -> None:
        n, shapes, sizes = avatar.gaussians.count, avatar.blendshapes, Sizes.of(avatar)
        self._blendable = blendable
        self._bound = (
            inputs.offsets(shapes.correctives, "mean", n, sizes.features),
            inputs.offsets(shapes.late_morphs, "mean", n, sizes.late),
            inputs.influences(avatar.skin, n, sizes.joints),
            inputs.blocks(avatar),
        )

    def animate(self, posed: PosedArrays, vertices: F32 | None, out: Out, threads: int) -> None:
        """See `Binding`; `vertices` are not read."""
        share(animate_skinned, threads, threads, *self._blendable, *self._bound, posed, out)

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        """See `Binding`; `vertices` are not read."""
        out = inputs.fresh_out(len(blended.mean), 0)
        bind_skinned(blended.mean, blended.quat_wxyz, *self._bound, posed, out)
        return out._replace(scale=blended.log_scale)


class EmbeddedBinding:
    """Gaussians embedded in a triangle mesh."""

    def __init__(self, avatar: Avatar, blendable: Blendable) -> None:
        assert avatar.embedding is not None
        rules, unit = avatar.rules, avatar.training_per_bundle
        # An area in training units is unit^2 times the area in bundle units.
        normal, quaternion, damping = (
            float(constants()[name]) / unit**2
            for name in ("normal_floor", "quaternion_floor", "area_damping")
        )
        self._mesh = inputs.mesh(prepare(avatar.embedding, rules, unit))
        self._blended = (blendable.base, blendable.shape, blendable.colour)
        self._bound = (
            inputs.embedded(avatar),
            self._mesh,
            EmbeddedRules(
                code("position", rules.position),
                code("scale", rules.scale),
                float(np.log(unit)),
                damping,
                rules.sh_direction == "world",
            ),
        )
        self._skin: Influences | None = None
        if rules.rotation in RIGGED_ROTATIONS:
            assert avatar.rig is not None
            vertices = len(avatar.embedding.canonical_vertices)
            self._skin = inputs.influences(avatar.rig.skin, vertices, avatar.rig.joint_count)
        self._posed_mesh = inputs.fresh_posed_mesh(self._mesh, by_joints=self._skin is not None)
        self._by_vertex = rules.rotation != "triangle_frame"
        self._rotation = code("rotation", rules.rotation)
        self._sign = code("quaternion_sign", rules.quaternion_sign)
        self._floors = (normal, quaternion)
        self._turn = threading.Lock()  # held while _posed_mesh is written or read

    def animate(self, posed: PosedArrays, vertices: F32 | None, out: Out, threads: int) -> None:
        """See `Binding`."""
        with self._turn:
            given = self._pose_mesh(vertices, posed)
            arrays = (*self._blended, *self._bound, self._posed_mesh, given, posed, out)
            share(animate_embedded, threads, threads, *arrays)

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        """See `Binding`."""
        out = inputs.fresh_out(len(blended.mean), 0)
        with self._turn:
            given = self._pose_mesh(vertices, posed)
            bind_embedded(blended.log_scale, *self._bound, self._posed_mesh, given, posed, out)
        return out

    def _pose_mesh(self, vertices: F32 | None, posed: PosedArrays) -> F32:
        """Fills `_posed_mesh` for the posed `vertices` [V, 3] and returns them; `_turn` must be held."""
        assert vertices is not None
        mesh, made = self._mesh, self._posed_mesh
        given = read_only(vertices, np.float32, (len(made.vertex), 3))
        triangle_turns(given, mesh, self._rotation, self._sign, made)
        if self._by_vertex:
            vertex_sums(mesh, *self._floors, self._rotation, made)
        if self._skin is not None:
            vertex_matrices(self._skin, posed.skin_matrix, made.matrix)
        return given
