"""Stage `blend`: Gaussian blendshapes, in training space."""

from __future__ import annotations

from avatar_runtime.avatar import F32, Blendshapes, Gaussians
from avatar_runtime.stages.sparse import combine


def blend(gaussians: Gaussians, blendshapes: Blendshapes, expression_weights: F32) -> Gaussians:
    """G = base + sum_k w_k delta_k for every attribute, before any activation.

    Raw quaternions, log scales and opacity logits add as they are (GaussianBlendshapes 2952da7
    face_gs_model.py:583; paper eq. 1 names no space).
    """
    geometry = combine(blendshapes.geometry, expression_weights)
    appearance = combine(blendshapes.appearance, expression_weights)
    return Gaussians(
        gaussians.mean + geometry["mean"],
        gaussians.log_scale + appearance["log_scale"],
        gaussians.quat_wxyz + geometry["quat_wxyz"],
        gaussians.opacity_logit + appearance["opacity_logit"],
        gaussians.sh + appearance["sh"],
    )
