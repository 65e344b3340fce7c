"""Stage `morph`: the mesh before its skeleton moves it."""

from __future__ import annotations

from avatar_runtime.avatar import F32, Rig
from avatar_runtime.stages.sparse import combine


def morph(rig: Rig, expression_weights: F32, pose_feature: F32) -> F32:
    """V = template + sum_k w_k morph_k + sum_j feature_j corrective_j, [V, 3]."""
    result = rig.vertices + combine(rig.morphs, expression_weights)["position"]
    return result + combine(rig.correctives, pose_feature)["position"]
