"""Shared by the synthetic captures: the resolution of rendering, and the errors of the stated parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.camera import Camera
from avatar_runtime.rotation import matrix_from_rotvec
from avatar_trainer.captures.mesh_raster import MeshImage
from avatar_trainer.captures.own import Shot

Array = npt.NDArray[Any]

RAYS = 768  # along an edge of the image, at least 3 to a pixel: small images see the same texture with more
TEST_SHARE = 0.2  # of the frames, the last ones


@dataclass(frozen=True)
class Noise:
    """The errors of the parameters that a capture states; its images have none. Normal, independent, seeded."""

    tracking: float = 0.0  # deviation of expression weights, and of joint rotations in radians
    calibration: float = (
        0.0  # of the camera: rotation in radians, translation in metres, share of the focal length
    )
    seed: int = 0
    rng: np.random.Generator = field(init=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "rng", np.random.default_rng(self.seed))

    def tracked(self, values: Array) -> Array:
        """The values with the errors of a tracker."""
        result: Array = values + self.tracking * self.rng.standard_normal(np.shape(values))
        return result

    def calibrated(self, k: Array, rotation: Array, translation: Array) -> tuple[Array, Array, Array]:
        """(K, R, t) with the errors of a calibration."""
        turn, shift, zoom = (self.calibration * self.rng.standard_normal(n) for n in (3, 3, 1))
        focal = np.diag([1 + zoom[0], 1 + zoom[0], 1])
        return k @ focal, matrix_from_rotvec(turn) @ rotation, translation + shift


def rays_per_pixel(size: int) -> int:
    """Rays across a pixel of an image of this size."""
    return max(3, -(-RAYS // size))


def camera_towards(
    target: Array, distance: float, yaw: float, pitch: float, fov_y: float, size: int
) -> tuple[Array, Array, Array]:
    """(K, R, t), OpenCV, of a camera that looks at `target`; square images of `size` pixels."""
    camera = Camera.orbit(np.asarray(target), distance, yaw, pitch, fov_y, size, size)
    seen = camera.camera_from_world.astype(np.float64)
    focal = size / (2 * np.tan(fov_y / 2))
    k = np.array([[focal, 0, size / 2], [0, focal, size / 2], [0, 0, 1]])
    return k, seen[:3, :3], seen[:3, 3]


def splits(frames: int) -> list[str]:
    """`train`, and `test` for the last frames; one of each at least. ValueError for fewer than two frames."""
    if frames < 2:
        raise ValueError(f"{frames} frames: one to train and one to test are the least")
    test = max(1, round(frames * TEST_SHARE))
    return ["train"] * (frames - test) + ["test"] * test


def shot(
    drawn: MeshImage,
    camera: tuple[Array, Array, Array],  # the stated K, R, t
    expression: Array,
    joints: Mapping[str, Array],
    split: str,
    world_from_avatar: Array | None = None,
) -> Shot:
    """A frame for `capture.write`, 8 bits a channel."""
    image, mask = (np.round(np.clip(x, 0, 1) * 255).astype(np.uint8) for x in (drawn.colour, drawn.alpha))
    return Shot(
        image, mask, *camera, expression.tolist(), joints, world_from_avatar=world_from_avatar, split=split
    )
