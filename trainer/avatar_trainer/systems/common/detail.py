"""Where training frames come close: more Gaussians begin there.

A choice of ours; the papers' captures keep one distance, and then every triangle counts 1.
"""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F64
from avatar_trainer.captures.model import Capture

FRAMES = 8  # that show a triangle so closely, at least
FACING = 0.3  # least cosine between normal and view
MOST = 8.0
BY_AREA = 1.5  # the power where points are spread by area: body models are finer at eyes and lips themselves


def detail(capture: Capture, power: float = 1.0) -> F64:
    """[F] density of the first Gaussians on each triangle: the square of how much closer its closest frames show it.

    Compared with the distance at which half of the triangles are seen; a power of two, 1 to MOST, to the `power`. The
    rig is taken at rest, and what hides a triangle is not tested.
    """
    rig = capture.rig
    corner = rig.vertices.astype(np.float64)[rig.triangles]
    middle = corner.mean(axis=1)
    normal = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
    shown = np.zeros((FRAMES, len(middle)))  # pixels a metre, the most in row 0
    for frame in capture.train:
        world = frame.pose.world_from_avatar.astype(np.float64)
        place = middle @ world[:3, :3].T + world[:3, 3]
        clip = place @ frame.camera.clip_from_world[:, :3].T + frame.camera.clip_from_world[:, 3]
        way = frame.camera.centre - place
        facing = np.sum(way * (normal @ world[:3, :3].T), axis=1) > FACING * np.linalg.norm(way, axis=1)
        inside = facing & (clip[:, 3] > 0) & (np.abs(clip[:, :2]) < clip[:, 3:]).all(axis=1)
        focal = np.linalg.norm(frame.camera.clip_from_world[1, :3]) * frame.camera.height / 2
        here = np.where(inside, focal / np.where(inside, clip[:, 3], 1), 0)
        shown = -np.sort(-np.concatenate([shown, here[None]]), axis=0)[:FRAMES]
    least = shown[-1]
    if not (least > 0).any():
        return np.ones(len(middle))
    ratio = np.maximum(least / np.median(least[least > 0]), 1)
    result: F64 = np.minimum(2.0 ** np.floor(2 * np.log2(ratio)), MOST) ** power
    return result
