"""What stands before an avatar: the depth of a box at each pixel, and pixels of an avatar that is cut by a depth."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime.avatar import F64, Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose
from avatar_runtime.stages.project import project
from avatar_schema import constants

UNSURE = 1e-5  # of the depth: nearer to the cut, a splat may fall on either side
Bools = npt.NDArray[np.bool_]
Pixels = npt.NDArray[np.int64]


def box_depth(place: F64, size: npt.ArrayLike, camera: Camera) -> F64:
    """[H, W] view depth of a box's surface where the pixel's centre shows it; infinite elsewhere."""
    y, x = np.mgrid[: camera.height, : camera.width]
    across = ((x + 0.5) / camera.width * 2 - 1) * camera.tan_half_fov_x
    down = ((y + 0.5) / camera.height * 2 - 1) * camera.tan_half_fov_y
    rays = np.stack([across, down, np.ones_like(across)], axis=-1)  # view depth 1
    own_from_camera = np.linalg.inv(camera.camera_from_world.astype(np.float64) @ place)
    start, rays = own_from_camera[:3, 3], rays @ own_from_camera[:3, :3].T
    half = np.asarray(size) / 2
    with np.errstate(divide="ignore"):
        ends = np.stack([(-half - start) / rays, (half - start) / rays])
    enter, leave = ends.min(axis=0).max(axis=-1), ends.max(axis=0).min(axis=-1)
    found: F64 = np.where((enter <= leave) & (enter > 0), enter, np.inf)
    return found


def cut(avatar: Avatar, pose: Pose, camera: Camera, at: Pixels, limit: F64) -> tuple[F64, Bools]:
    """(premultiplied colour and alpha [P, 4], whether that is sure [P]) of pixels `at` [P, 2] (column, row).

    Only splats whose centre is nearer than `limit` [P] count.
    """
    seen = project(Player(avatar, "reference").animate(pose), camera, avatar.raster, avatar.sh_degree)
    drawn = np.flatnonzero(seen.radius > 0)
    order = drawn[np.argsort(seen.depth[drawn], kind="stable")]
    depth, opacity = seen.depth[order].astype(np.float64), seen.opacity[order].astype(np.float64)
    conic = seen.conic[order].astype(np.float64)
    offset = seen.centre[order].astype(np.float64) - at[:, None]  # [P, N, 2]
    dx, dy = offset[..., 0], offset[..., 1]
    power = -0.5 * (conic[:, 0] * dx * dx + conic[:, 2] * dy * dy) - conic[:, 1] * dx * dy
    alpha = np.minimum(constants()["alpha_max"], opacity * np.exp(np.minimum(power, 0)))
    alpha[(power > 0) | (alpha < 1 / constants()["alpha_min_denominator"])] = 0
    near = np.abs(depth - limit[:, None]) < UNSURE * depth
    sure = ~(near & (alpha > 0)).any(axis=1)
    alpha[depth >= limit[:, None]] = 0
    after = np.cumprod(1 - alpha, axis=1)
    weight = alpha * np.concatenate([np.ones((len(at), 1)), after[:, :-1]], axis=1)
    return np.concatenate([weight @ seen.rgb[order], 1 - after[:, -1:]], axis=1), sure
