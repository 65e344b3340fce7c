"""PSAvatar's mesh: the body model with learned corrective bases (Eqs. 4 to 6), posed.

    v = M (T + B_P + B_E + w_P P' + w_E E'),    M = sum_b W_b A_b

Joints, and with them A, come from the shape without the learned part. M and the first three terms depend only on the
pose and are kept, as long as there is room.
"""

from __future__ import annotations

from collections import OrderedDict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from avatar_runtime import F32, I64, PoseArrays, Rig
from avatar_runtime.stages import joints, morph, sparse
from avatar_trainer.stages.skin import transform

ROOM = 512 << 20  # bytes of posed bodies that are kept


@dataclass(frozen=True)
class Body:
    """The body model in one pose; no gradient."""

    unposed: Tensor  # [V, 3] metres, before the learned bases and skinning
    matrix: Tensor  # [V, 3, 4] of skinning
    coefficients: Tensor  # [C + K] pose feature, then expression weights


class Bodies:
    """The body model in each pose."""

    def __init__(self, rig: Rig) -> None:
        self._rig = rig
        # By the identity of the pose object, which is kept too, so that its identity is not reused.
        self._kept: OrderedDict[int, tuple[PoseArrays, Body]] = OrderedDict()
        self._bytes = 0

    def __getitem__(self, pose: PoseArrays) -> Body:
        found = self._kept.get(id(pose))
        if found is None:
            found = (pose, body_of(self._rig, pose))
            self._keep(found)
        self._kept.move_to_end(id(pose))
        return found[1]

    def _keep(self, entry: tuple[PoseArrays, Body]) -> None:
        self._kept[id(entry[0])] = entry
        self._bytes += _size(entry[1])
        while self._bytes > ROOM and len(self._kept) > 1:
            _, (_, dropped) = self._kept.popitem(last=False)
            self._bytes -= _size(dropped)


def body_of(rig: Rig, pose: PoseArrays) -> Body:
    """The body of `pose`, by the runtime's stages."""
    state = joints.joints(rig, pose)
    matrix = sparse.gather(rig.skin, state.skin_matrix[:, :3])
    coefficients = np.concatenate([state.pose_feature, pose.expression_weights.astype(np.float32)])
    return Body(
        torch.from_numpy(morph.morph(rig, pose.expression_weights, state.pose_feature)),
        torch.from_numpy(np.ascontiguousarray(matrix, np.float32)),
        torch.from_numpy(coefficients),
    )


def posed(body: Body, bases: Tensor, used: Tensor) -> Tensor:
    """[V, 3] posed vertices, metres; differentiable in `bases` [U, V, 3], of the coefficients `used` [U] int64."""
    learned = (body.coefficients[used] @ bases.flatten(1)).reshape(-1, 3)
    return transform(body.matrix, body.unposed + learned)


def used_coefficients(rig: Rig, poses: Sequence[PoseArrays]) -> Tensor:
    """[U] int64: the coefficients that are not 0 in some of `poses`; no gradient reaches the bases of others."""
    count = 9 * len(rig.corrective_joints)
    weights: F32 = np.stack([p.expression_weights for p in poses]).astype(np.float32)
    features = np.stack([joints.joints(rig, p).pose_feature for p in poses]).reshape(len(poses), count)
    found: I64 = np.flatnonzero(np.concatenate([features, weights], axis=1).any(axis=0))
    return torch.from_numpy(found)


def _size(body: Body) -> int:
    return body.unposed.nbytes + body.matrix.nbytes + body.coefficients.nbytes
