"""The difference between the two raster profiles."""

from __future__ import annotations

import numpy as np

from avatar_export.images import frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose


def profile_psnr(avatar: Avatar, pose: Pose, size: int, yaw: float = 0.0) -> float:
    """PSNR in dB of `engine` against `trainer`, where the avatar covers more than half of a pixel; over black."""
    player, camera = Player(avatar), frame_camera(robust_box(avatar.gaussians.mean), size, size, yaw)
    trainer, engine = (
        player.frame(pose, camera, (0.0, 0.0, 0.0), profile).image for profile in ("trainer", "engine")
    )
    mask = trainer.transmittance < 0.5
    error = (engine.colour[mask] - trainer.colour[mask]).astype(np.float64)
    return float(-10 * np.log10(np.mean(error**2)))
