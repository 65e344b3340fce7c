"""Gaussians on a mesh for the tests of stage surface and of its kernels."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import product

import torch
from torch import Tensor

from avatar_runtime.avatar import Avatar, Rules
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.posed import posed_mesh
from avatar_runtime.rules import AREA_SCALES, NORMAL_POSITIONS, RIGGED_ROTATIONS, VERTEX_ROTATIONS
from avatar_runtime.stages.joints import joints
from avatar_runtime.stages.skin import vertex_matrices
from avatar_trainer.stages.surface import SurfaceMesh, embed, pose_mesh, surface_mesh
from tests.avatars import surface_avatar
from tests.trainer.tensors import poses, tensor

RULES = [
    Rules(rotation, position=position, scale=scale)
    for rotation, position, scale in (
        *product(VERTEX_ROTATIONS, NORMAL_POSITIONS, AREA_SCALES),
        *product(RIGGED_ROTATIONS, NORMAL_POSITIONS, ["none"]),
    )
]
NAMES = ["-".join((r.rotation, r.position, r.scale)) for r in RULES]


@dataclass(frozen=True)
class SurfaceCase:
    """An avatar on its mesh, and the mesh posed."""

    avatar: Avatar
    mesh: SurfaceMesh
    triangle: Tensor
    posed: tuple[Tensor, ...]  # [V, 3] float32 of each frame
    matrix: tuple[Tensor | None, ...]  # [V, 3, 3] of each frame, where the rotation rule reads it

    def values(self) -> tuple[Tensor, ...]:
        """Barycentric, displacement, local_quat_wxyz, log_scale."""
        e = self.avatar.embedding
        assert e is not None
        arrays = (e.barycentric, e.displacement, e.local_quat_wxyz, self.avatar.gaussians.log_scale)
        return tuple(map(tensor, arrays))


def surface_case(rules: Rules) -> SurfaceCase:
    avatar = check_avatar(replace(surface_avatar(), rules=rules))
    e, rig = avatar.embedding, avatar.rig
    assert e is not None and rig is not None
    states = [(pose, joints(rig, pose)) for pose in poses(avatar)]
    posed = [tensor(posed_mesh(rig, pose, state)) for pose, state in states]
    matrix: list[Tensor | None] = [None] * len(posed)
    if rules.rotation in RIGGED_ROTATIONS:
        matrix = [tensor(vertex_matrices(rig, state.skin_matrix)) for _, state in states]
    mesh = surface_mesh(e.canonical_vertices, e.triangles, avatar.training_per_bundle)
    return SurfaceCase(avatar, mesh, tensor(e.triangle, torch.int64), tuple(posed), tuple(matrix))


def embedded(
    given: SurfaceCase, matrix: Tensor | None, vertices: Tensor, *values: Tensor
) -> Mapping[str, Tensor]:
    """Stage surface whole: mean, quat_wxyz, rotation, log_scale; `matrix` is one of `given.matrix`."""
    rules = given.avatar.rules
    under = pose_mesh(vertices, given.mesh, rules, matrix)
    return vars(embed(under, given.mesh, given.triangle, *values, rules))
