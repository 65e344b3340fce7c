"""A pinhole camera in the trainer's convention: +x right, +y down, +z forward, pixel centres at integers."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F32

CLIP_NEAR, CLIP_FAR = (
    0.01,
    100.0,
)  # of the projection matrix only; RasterSettings.near decides what is drawn


@dataclass(frozen=True)
class Camera:
    """Row-major matrices for column vectors, float32 as the rasteriser takes them."""

    camera_from_world: F32  # [4, 4]
    clip_from_world: F32  # [4, 4] projection @ camera_from_world
    centre: F32  # [3] world
    tan_half_fov_x: float  # width / (2 fx)
    tan_half_fov_y: float  # height / (2 fy)
    width: int
    height: int

    def mirrored(self) -> Camera:
        """The camera that sees the same image of the mirrored world, whose x is negated (`handedness.mirrored`).

        Camera space stays as it is, so camera_from_world takes S = diag(-1, 1, 1) first: its determinant is -1.
        """
        signs = np.array([-1, 1, 1, 1], np.float32)
        return replace(
            self,
            camera_from_world=self.camera_from_world * signs,
            clip_from_world=self.clip_from_world * signs,
            centre=self.centre * signs[:3],
        )

    @staticmethod
    def from_opencv(
        rotation: npt.NDArray[Any],  # [3, 3]
        translation: npt.NDArray[Any],  # [3]
        intrinsics: npt.NDArray[Any],  # [3, 3] K, pixels, pixel centres at half integers
        width: int,
        height: int,
    ) -> Camera:
        """x_camera = rotation @ x_world + translation, x_pixel = K x_camera / z - 0.5.

        The principal point moves the centres; the Jacobian's clamp stays about the optical axis, as trained.
        """
        if width < 1 or height < 1:
            raise ValueError(f"an image of {width}x{height} pixels is empty; both sizes must be at least 1")
        view = np.eye(4)
        view[:3, :3], view[:3, 3] = rotation, translation
        k = np.asarray(intrinsics, np.float64)
        fx, fy, skew, cx, cy = k[0, 0], k[1, 1], k[0, 1], k[0, 2], k[1, 2]
        depth = CLIP_FAR / (CLIP_FAR - CLIP_NEAR)
        projection = np.array(
            [
                [2 * fx / width, 2 * skew / width, 2 * cx / width - 1, 0],
                [0, 2 * fy / height, 2 * cy / height - 1, 0],
                [0, 0, depth, -depth * CLIP_NEAR],
                [0, 0, 1, 0],
            ]
        )
        return Camera(
            view.astype(np.float32),
            (projection @ view).astype(np.float32),
            (-view[:3, :3].T @ view[:3, 3]).astype(np.float32),
            float(np.float32(width / (2 * fx))),
            float(np.float32(height / (2 * fy))),
            width,
            height,
        )

    @staticmethod
    def orbit(
        target: npt.NDArray[Any],  # [3] world
        distance: float,
        yaw: float,  # radians about +Y; positive moves the camera to +X
        pitch: float,  # radians; positive moves the camera up
        fov_y: float,  # radians
        width: int,
        height: int,
    ) -> Camera:
        """A camera that looks at `target`; at yaw 0 it is in front of a face that looks along +Z."""
        away = np.array([np.sin(yaw) * np.cos(pitch), np.sin(pitch), np.cos(yaw) * np.cos(pitch)])
        right = np.array([np.cos(yaw), 0.0, -np.sin(yaw)])
        forward = -away
        down = np.cross(forward, right)
        rotation = np.stack([right, down, forward])
        eye = np.asarray(target, np.float64) + distance * away
        focal = height / (2 * np.tan(fov_y / 2))
        k = np.array([[focal, 0, width / 2], [0, focal, height / 2], [0, 0, 1]])
        return Camera.from_opencv(rotation, -rotation @ eye, k, width, height)
