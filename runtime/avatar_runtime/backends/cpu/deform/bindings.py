"""What carries an avatar's Gaussians: its joints and groups, or a mesh. One class each, with the same methods."""

from __future__ import annotations

import threading
from typing import Protocol

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.backends.cpu.arrays import (
    U8,
    Base,
    Blendable,
    Embedded,
    Influences,
    Mesh,
    Out,
    PosedArrays,
    Ridden,
    Sizes,
)
from avatar_runtime.backends.cpu.deform import plain
from avatar_runtime.backends.cpu.deform.embedded import animate_riding, bind_riding
from avatar_runtime.backends.cpu.deform.mesh import vertex_matrices
from avatar_runtime.backends.cpu.deform.skinned import animate_skinned, bind_skinned
from avatar_runtime.backends.cpu.deform.surface import triangle_turns, vertex_sums
from avatar_runtime.rules import RIGGED_ROTATIONS, code
from avatar_runtime.stages.surface import prepare
from avatar_schema import constants


class Carrier(Protocol):
    """Stages blend, bind and activate of one avatar."""

    def animate(self, posed: PosedArrays, vertices: F32 | None, touched: U8, out: Out, threads: int) -> None:
        """Writes the splats of a frame into `out`."""
        ...

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        """Stage `bind` alone; its log scale in `scale`."""
        ...


class SkinnedGaussians:
    """Gaussians that joints or groups carry."""

    def __init__(self, avatar: Avatar, blendable: Blendable) -> None:
        n, shapes, sizes = avatar.gaussians.count, avatar.blendshapes, Sizes.of(avatar)
        self._blendable = blendable
        self._bound = (
            plain.offsets(shapes.correctives, "mean", n, sizes.features),
            plain.offsets(shapes.late_morphs, "mean", n, sizes.late),
            plain.influences(avatar.skin, n, sizes.joints),
            plain.blocks(avatar.groups, avatar.rules.rotation, n),
            avatar.rules.sh_direction == "world",
        )

    def animate(self, posed: PosedArrays, vertices: F32 | None, touched: U8, out: Out, threads: int) -> None:
        animate_skinned(*self._blendable, *self._bound, posed, touched, out, threads)

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        out = plain.fresh_out(len(blended.mean), 0)
        bind_skinned(blended.mean, blended.quat_wxyz, *self._bound, posed, out)
        return out._replace(scale=blended.log_scale)


class RidingGaussians:
    """Gaussians on a mesh."""

    def __init__(self, avatar: Avatar, blendable: Blendable) -> None:
        assert avatar.embedding is not None
        self._blendable = blendable
        self._embedded = plain.embedded(avatar)
        self._mesh = plain.mesh(prepare(avatar.embedding, avatar.rules, avatar.training_per_bundle))
        self._skin: Influences | None = None
        if avatar.rules.rotation in RIGGED_ROTATIONS:
            assert avatar.rig is not None
            vertices = len(avatar.embedding.canonical_vertices)
            self._skin = plain.influences(avatar.rig.skin, vertices, avatar.rig.joint_count)
        self._ridden = plain.fresh_ridden(self._mesh, by_joints=self._skin is not None)
        self._by_vertex = avatar.rules.rotation != "triangle_frame"
        self._rotation_rule = code("rotation", avatar.rules.rotation)
        self._position_rule = code("position", avatar.rules.position)
        self._sign_rule = code("quaternion_sign", avatar.rules.quaternion_sign)
        # An area in training units is u^2 times one in bundle units.
        normal, quaternion, damping = (
            float(constants()[name]) / avatar.training_per_bundle**2
            for name in ("normal_floor", "quaternion_floor", "area_damping")
        )
        self._floors = (normal, quaternion)
        self._scale = (code("scale", avatar.rules.scale), float(np.log(avatar.training_per_bundle)), damping)
        self._sh_world = avatar.rules.sh_direction == "world"
        self._turn = threading.Lock()  # held while _ridden is written or read

    def animate(self, posed: PosedArrays, vertices: F32 | None, touched: U8, out: Out, threads: int) -> None:
        with self._turn:
            animate_riding(
                *self._blendable,
                *self._under(vertices, posed),
                *self._scale,
                self._sh_world,
                posed,
                touched,
                out,
                threads,
            )

    def bind(self, blended: Base, posed: PosedArrays, vertices: F32 | None) -> Out:
        out = plain.fresh_out(len(blended.mean), 0)
        with self._turn:
            under = self._under(vertices, posed)
            bind_riding(blended.log_scale, *under, *self._scale, self._sh_world, posed, out)
        return out

    def _under(self, vertices: F32 | None, frame: PosedArrays) -> tuple[Embedded, Mesh, Ridden, F32, int]:
        """The posed mesh as both passes over Gaussians take it; `_turn` must be held."""
        assert vertices is not None
        posed = plain.plain(vertices, np.float32, (len(self._ridden.vertex), 3))
        triangle_turns(posed, self._mesh, self._rotation_rule, self._sign_rule, self._ridden)
        if self._by_vertex:
            vertex_sums(self._mesh, *self._floors, self._rotation_rule, self._ridden)
        if self._skin is not None:
            vertex_matrices(self._skin, frame.skin_matrix, self._ridden.matrix)
        return self._embedded, self._mesh, self._ridden, posed, self._position_rule
