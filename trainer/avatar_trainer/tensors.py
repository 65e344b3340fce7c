"""What the stages hand on during training: the runtime's containers with tensors in them.

Any floating type; float32 to train, float64 to check gradients. Shapes, spaces and units are those of
`avatar_runtime.avatar.Gaussians`, `stages.activate.Splats` and `stages.project.Projected`.
"""

from __future__ import annotations

from dataclasses import dataclass

from torch import Tensor


@dataclass(frozen=True)
class Gaussians:
    """N splats in training space."""

    mean: Tensor  # [N, 3]
    log_scale: Tensor  # [N, 3]
    quat_wxyz: Tensor  # [N, 4] raw
    opacity_logit: Tensor  # [N]
    sh: Tensor  # [N, K, 3] coefficient-major, DC without the + 0.5


@dataclass(frozen=True)
class Splats:
    """Activated splats, world space, as the rasteriser takes them."""

    mean: Tensor  # [N, 3]
    scale: Tensor  # [N, 3] standard deviations
    quat_wxyz: Tensor  # [N, 4] used as it is
    opacity: Tensor  # [N] 0..1
    sh: Tensor  # [N, K, 3]
    sh_rotation: Tensor | None = (
        None  # [N, 3, 3], no gradient; colour is seen along sh_rotation^T d; None: along d
    )


@dataclass(frozen=True)
class Points:
    """Discs that face the camera, as shape acquisition takes them (PSAvatar section 3.1, Eq. 3)."""

    mean: Tensor  # [N, 3] world space
    radius: Tensor  # [N] metres; on the screen focal_x * radius / depth
    opacity: Tensor  # [N] beta, 0..1, at the centre
    rgb: Tensor  # [N, 3]


@dataclass(frozen=True)
class Rendered:
    """An image and what density control reads of it."""

    colour: Tensor  # [H, W, 3] over the background, display-referred, not clamped
    alpha: Tensor  # [H, W] 1 - transmittance
    radius: Tensor  # [N] int32 pixels, 0 where a splat is not drawn; no gradient
    visibility: Tensor | None = None  # [N] of points: the largest weight at any pixel; no gradient
