"""Stage `activate`: out of training space, once; twin of `avatar_runtime.stages.activate`."""

from __future__ import annotations

import torch
from torch import Tensor

from avatar_trainer.tensors import Gaussians, Splats

SHORTEST = 1e-12  # a shorter quaternion is divided by this


def activate(gaussians: Gaussians, sh_rotation: Tensor | None) -> Splats:
    """exp of the scale, sigmoid of the opacity, unit quaternion. `sh_rotation` [N, 3, 3] as `Splats` has it."""
    quat = gaussians.quat_wxyz
    length = torch.linalg.vector_norm(quat, dim=-1, keepdim=True)
    return Splats(
        gaussians.mean,
        gaussians.log_scale.exp(),
        quat / length.clamp_min(SHORTEST),
        gaussians.opacity_logit.sigmoid(),
        gaussians.sh,
        None if sh_rotation is None else sh_rotation.detach(),
    )
