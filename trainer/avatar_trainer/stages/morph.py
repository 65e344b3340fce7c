"""Stage `morph`: the mesh before its skeleton moves it; twin of `avatar_runtime.stages.morph`."""

from __future__ import annotations

from torch import Tensor

from avatar_trainer.stages.rig import RigTensors
from avatar_trainer.stages.sparse import combine


def morph(rig: RigTensors, expression_weights: Tensor, pose_feature: Tensor) -> Tensor:
    """V = template + sum_k w_k morph_k + sum_j feature_j corrective_j, [V, 3]; differentiable in both weights."""
    return rig.vertices + combine(rig.morphs, expression_weights) + combine(rig.correctives, pose_feature)
