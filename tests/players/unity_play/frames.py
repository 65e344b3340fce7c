"""What backend `gl` draws of a pack."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from avatar_runtime.avatar import F32, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose

ROUNDING = 2.0**-24
BLACK = (0.0, 0.0, 0.0)


@dataclass(frozen=True)
class Frame:
    """An image [H, W, 4]: premultiplied colour and alpha."""

    image: F32


def frame_of(avatar: Avatar, pose: Pose, camera: Camera, level: int = 0) -> Frame:
    """What backend `gl` draws of an avatar from a pack."""
    image = Player(avatar, "gl", level=level, target="rgba32f").frame(pose, camera, BLACK).image
    return Frame(np.dstack([image.colour, 1 - image.transmittance]))
