"""Stage `blend`: Gaussian blendshapes, in training space; twin of `avatar_runtime.stages.blend`."""

from __future__ import annotations

from dataclasses import dataclass

import torch
from torch import Tensor

from avatar_trainer.tensors import Gaussians


@dataclass(frozen=True)
class Deltas:
    """Sparse differences of the expression blendshapes, one pattern for every attribute.

    Row i owns the entries row_ptr[i]:row_ptr[i+1].
    """

    row_ptr: Tensor  # [N + 1] int64
    column: Tensor  # [E] int64, the expression
    mean: Tensor  # [E, 3]
    quat_wxyz: Tensor  # [E, 4]
    log_scale: Tensor  # [E, 3]
    opacity_logit: Tensor  # [E]
    sh: Tensor  # [E, K, 3]


def blend(base: Gaussians, deltas: Deltas, expression_weights: Tensor) -> Gaussians:
    """G = base + sum_k w_k delta_k for every attribute, before any activation; differentiable in all three.

    Raw quaternions, log scales and opacity logits add as they are (GaussianBlendshapes 2952da7
    face_gs_model.py:583; paper Eq. 1 names no space). The definition; `kernels.blend_cpu` is the fast one.
    """
    row = torch.repeat_interleave(deltas.row_ptr.diff())
    weight = expression_weights[deltas.column]

    def added(to: Tensor, delta: Tensor) -> Tensor:
        return to.index_add(0, row, delta * weight.reshape(-1, *[1] * (delta.dim() - 1)))

    return Gaussians(
        added(base.mean, deltas.mean),
        added(base.log_scale, deltas.log_scale),
        added(base.quat_wxyz, deltas.quat_wxyz),
        added(base.opacity_logit, deltas.opacity_logit),
        added(base.sh, deltas.sh),
    )
