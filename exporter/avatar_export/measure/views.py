"""The cameras that an avatar is measured through."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from avatar_export.images import frame_camera, seen
from avatar_export.measure.poses import NamedPose, poses
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera

SIZE = 512  # pixels
YAWS = {"front": 0.0, "40 degrees left": 40.0, "40 degrees right": -40.0}  # left: the avatar's left


@dataclass(frozen=True)
class NamedView:
    """A camera with a name for people."""

    name: str
    camera: Camera


@dataclass(frozen=True)
class Shot:
    """A pose through a view."""

    pose: NamedPose
    view: NamedView

    @property
    def name(self) -> str:
        """Both names, for people."""
        return f"{self.pose.name}, {self.view.name}"


def in_turn(shown: Sequence[NamedPose], through: Sequence[NamedView]) -> list[Shot]:
    """One shot a pose, through each view in turn."""
    return [Shot(pose, through[at % len(through)]) for at, pose in enumerate(shown)]


def views(avatar: Avatar, size: int = SIZE, shown: Sequence[NamedPose] | None = None) -> list[NamedView]:
    """Cameras in front of the avatar and 40 degrees to each side, square images of `size` pixels.

    All stand at the same distance and show the avatar in all poses `shown` (by default `poses(avatar)`), without the
    outermost thousandth of the Gaussians' centres.
    """
    box = seen(avatar, *(named.pose for named in (poses(avatar) if shown is None else shown)))
    return [
        NamedView(name, frame_camera(box, size, size, float(np.radians(yaw)))) for name, yaw in YAWS.items()
    ]
