"""Point splatting: alpha = beta (1 - r^2 / R^2) (PSAvatar Eq. 3)."""

from __future__ import annotations

from torch import Tensor

from avatar_runtime.avatar import RasterSettings
from avatar_runtime.camera import Camera
from avatar_trainer.tensors import Points, Rendered


def rasterise(
    points: Points,
    camera: Camera,
    settings: RasterSettings,
    background: Tensor,
    screen_offset: Tensor | None = None,
    threads: int | None = None,
) -> Rendered:
    """The picture of `points`."""
    raise NotImplementedError
