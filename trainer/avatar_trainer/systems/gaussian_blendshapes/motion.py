"""The motion of Gaussian Blendshapes besides expressions: joints, eyelids, groups of teeth."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np
import torch
from torch import Tensor

from avatar_export.readers.gaussian_blendshapes import reader
from avatar_runtime import (
    F32,
    F64,
    Avatar,
    Blendshapes,
    Expression,
    Group,
    PoseArrays,
    Poser,
    Rules,
    SparseRows,
)
from avatar_runtime import Gaussians as RuntimeGaussians
from avatar_trainer.captures.model import Capture
from avatar_trainer.stages.bind import skin_matrices
from avatar_trainer.stages.rotation import quat_from_matrix, quat_multiply
from avatar_trainer.stages.skin import transform
from avatar_trainer.systems.gaussian_blendshapes.rows import FACE, LOWER, UPPER, Rows
from avatar_trainer.tensors import Splats

GROUPS = {FACE: ("face", "skin"), UPPER: ("upper_teeth", "anchor"), LOWER: ("lower_teeth", "joint_mix")}


@dataclass(frozen=True)
class Carry:
    """One frame's transforms, as `kernels.skinned_cpu` takes them; the polar factors of `matrix` turn quaternions."""

    matrix: Tensor  # [N, 3, 4] posed from neutral
    corrective: Tensor | None  # [N, 3]; None: all 0
    late: Tensor | None  # [N, 3]; None: all 0


class Motion:
    """Makes `Carry` from poses, by the runtime's own joints and groups; nothing here is trained."""

    def __init__(self, capture: Capture, rules: Mapping[str, str]) -> None:
        self._poser = Poser(_empty_avatar(capture, rules))

    def carry(self, rows: Rows, pose: PoseArrays) -> Carry:
        """The transforms of `rows` in one pose."""
        posed = self._poser.posed(pose)
        matrix = torch.empty(rows.count, 3, 4)
        face = rows.of(FACE)
        matrix[face] = skin_matrices(rows.skin_weights[face], torch.from_numpy(posed.skin_matrix))
        for group in range(FACE + 1, len(posed.groups.matrix)):
            matrix[rows.of(group)] = torch.from_numpy(posed.groups.matrix[group])
        return Carry(
            matrix, _moved(rows.corrective, posed.pose_feature), _moved(rows.late, posed.late_weights)
        )


def placed(splats: Splats, world_from_avatar: F64) -> Splats:
    """The splats moved rigidly, as `avatar_runtime.stages.bind` does last; the identity changes no bit."""
    if np.array_equal(world_from_avatar, np.eye(4)):
        return splats
    world = torch.from_numpy(world_from_avatar.astype(np.float32))
    turn = world[:3, :3]
    return replace(
        splats,
        mean=transform(world[:3], splats.mean),
        quat_wxyz=quat_multiply(quat_from_matrix(turn), splats.quat_wxyz),
        sh_rotation=None if splats.sh_rotation is None else turn @ splats.sh_rotation,
    )


def _moved(fields: Tensor, weights: F32) -> Tensor | None:
    """[N, 3] sum of fields [F, N, 3] times weights [F]; fields of zero weight are not read."""
    used = np.flatnonzero(weights[: len(fields)])
    if not len(used):
        return None
    chosen = fields[torch.from_numpy(used)].reshape(len(used), -1)
    return (torch.from_numpy(weights[used]) @ chosen).reshape(fields.shape[1:])


def _empty_avatar(capture: Capture, rules: Mapping[str, str]) -> Avatar:
    """The rig and the groups as the runtime knows them, without Gaussians."""
    none = SparseRows.empty(0, 0, {"mean": (3,)})
    blank = np.zeros((0, 3), np.float32)
    mouth = rules["mouth"] == "on"
    mix = {LOWER: reader.LOWER_TEETH[rules["lower_teeth"]]}
    return Avatar(
        name=capture.name,
        gaussians=RuntimeGaussians(blank, blank, blank[:, :0], blank[:, 0], blank[:, None]),
        groups=tuple(
            Group(name, 0, 0, binding, mix.get(group, {}))
            for group, (name, binding) in GROUPS.items()
            if mouth or group == FACE
        ),
        rules=Rules(rotation="polar3", sh_direction="inverse_rotation", anchor=rules["anchor"]),
        expressions=tuple(Expression(name) for name in capture.expression_names),
        eyelids=capture.eyelids,
        blendshapes=Blendshapes(none, none, none, none),
        skin=SparseRows.empty(0, capture.rig.joint_count, {"weight": ()}),
        rig=capture.rig,
        sh_degree=0,
    )
