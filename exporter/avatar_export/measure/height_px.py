"""How tall an avatar stands in an image, by the one definition of `height_px` (SPEC) that all players share."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import numpy.typing as npt


def height_px(
    framing_whole: Mapping[str, Any] | None,
    clip_from_world: npt.NDArray[Any],  # [4, 4] row-major, for column vectors
    world_from_avatar: npt.NDArray[Any] | None,  # [4, 4] a rotation times a uniform scale; None: identity
    image_height_px: float,  # physical pixels
) -> float:
    """The physical pixels that a length of `size[1]` of `framing.whole` covers, facing the camera, at its `target`.

    How avatar and camera are turned does not matter. For a pinhole camera it is focal_y * scale * size[1] / depth.
    Infinite, which means level 0, without framing or where the target does not lie in front of the camera.
    """
    if framing_whole is None:
        return math.inf
    clip = np.asarray(clip_from_world, np.float64)
    target = np.append(np.asarray(framing_whole["target"], np.float64), 1.0)
    scale = 1.0
    if world_from_avatar is not None:
        placement = np.asarray(world_from_avatar, np.float64)
        target = np.append((placement @ target)[:3], 1.0)
        scale = float(np.cbrt(abs(np.linalg.det(placement[:3, :3]))))
    w = float(clip[3] @ target)
    height = (
        float(np.linalg.norm(clip[1, :3])) * scale * float(framing_whole["size"][1]) * image_height_px / 2
    )
    return height / w if w > 0 and math.isfinite(height / w) else math.inf
