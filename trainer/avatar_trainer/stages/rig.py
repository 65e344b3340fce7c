"""A rig as tensors."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_runtime.avatar import Rig
from avatar_runtime.stages.joints import rest_transforms
from avatar_trainer.stages.sparse import Entries


@dataclass(frozen=True)
class RigTensors:
    """The arrays of `avatar_runtime.avatar.Rig` for stages joints, morph and skin; the skeleton is always float64."""

    vertices: Tensor  # [V, 3]
    morphs: Entries  # by expression
    correctives: Entries  # by pose feature
    late_morphs: Entries  # by late morph
    skin: Entries  # by joint
    parents: tuple[int, ...]  # [J], a parent before its children
    rest: Tensor  # [J, 4, 4] mesh_from_joint, float64
    inverse_bind_matrix: Tensor  # [J, 4, 4] joint_from_mesh, float64
    joint_basis: Tensor  # [K, J, 3] mesh space, float64
    corrective_joints: Tensor  # [C] int64

    @staticmethod
    def of(rig: Rig, dtype: torch.dtype = torch.float32) -> RigTensors:
        """`rig` in that floating type."""
        return RigTensors(
            torch.from_numpy(rig.vertices.copy()).to(dtype),
            Entries.of(rig.morphs, "position", dtype),
            Entries.of(rig.correctives, "position", dtype),
            Entries.of(rig.late_morphs, "position", dtype),
            Entries.of(rig.skin, "weight", dtype),
            tuple(int(parent) for parent in rig.parents),
            torch.from_numpy(rest_transforms(rig)),
            torch.from_numpy(rig.inverse_bind_matrix.astype("float64")),
            torch.from_numpy(rig.joint_basis.astype("float64")),
            torch.from_numpy(rig.corrective_joints.astype("int64")),
        )
