"""Where more Gaussians begin: where training frames come close, and where their colours change.

A choice of ours; the papers' captures keep one distance, and then every triangle counts 1 for `detail`.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_runtime import F64, I64, Camera, posed_mesh
from avatar_runtime.stages import joints
from avatar_trainer.captures.model import Capture
from avatar_trainer.captures.targets import Target, evenly, read

FRAMES = 8  # that show a triangle so closely, at least
FACING = 0.3  # least cosine between normal and view
MOST = 8.0
LOOKED_AT = 64  # frames at most, for colours
LEAST_BUSY, MOST_BUSY = 0.5, 4.0
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
        inside, a_metre, _, _ = _seen(frame.camera, place, normal @ world[:3, :3].T)
        here = np.where(inside, a_metre, 0)
        shown = -np.sort(-np.concatenate([shown, here[None]]), axis=0)[:FRAMES]
    least = shown[-1]
    if not (least > 0).any():
        return np.ones(len(middle))
    ratio = np.maximum(least / np.median(least[least > 0]), 1)
    result: F64 = np.minimum(2.0 ** np.floor(2 * np.log2(ratio)), MOST) ** power
    return result


def busy(capture: Capture) -> F64:
    """[F] how much faster colours change on each triangle than on half of all, LEAST_BUSY to MOST_BUSY.

    Change of brightness a metre, the median over frames that the triangle faces; what hides it is not tested. 1 for
    triangles that no frame shows.
    """
    rig, rows = capture.rig, []
    for frame in evenly(capture.train, LOOKED_AT):
        world = frame.pose.world_from_avatar.astype(np.float64)
        posed = posed_mesh(rig, frame.pose, joints.joints(rig, frame.pose)).astype(np.float64)
        corner = (posed @ world[:3, :3].T + world[:3, 3])[rig.triangles]
        place, normal = (
            corner.mean(axis=1),
            np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]),
        )
        normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-30)
        inside, a_metre, row, column = _seen(frame.camera, place, normal)
        rows.append(np.where(inside, _change(read(frame))[row, column] * a_metre, np.nan))
    found = np.array(rows)
    change = np.ones(found.shape[1])
    shown = np.isfinite(found).any(axis=0)
    change[shown] = np.nanmedian(found[:, shown], axis=0)
    usual = np.median(change[shown]) if shown.any() else 0.0
    if not usual > 0:
        return np.ones(len(change))
    result: F64 = np.where(shown, np.clip(change / usual, LEAST_BUSY, MOST_BUSY), 1.0)
    return result


def _change(target: Target) -> F64:
    """[H, W] change of brightness a pixel, of the person before black."""
    bright = (target.image * target.mask[:, :, None]).mean(dim=2).double().numpy()
    down, right = np.gradient(bright)
    change: F64 = np.hypot(down, right)
    return change


def _seen(camera: Camera, place: F64, normal: F64) -> tuple[npt.NDArray[np.bool_], F64, I64, I64]:
    """(whether the camera sees places [F, 3] that face it, pixels a metre there, row, column)."""
    clip = place @ camera.clip_from_world[:, :3].T + camera.clip_from_world[:, 3]
    way = camera.centre - place
    facing = np.sum(way * normal, axis=1) > FACING * np.linalg.norm(way, axis=1)
    inside = facing & (clip[:, 3] > 0) & (np.abs(clip[:, :2]) < clip[:, 3:]).all(axis=1)
    depth = np.where(inside, clip[:, 3], 1)
    focal = np.linalg.norm(camera.clip_from_world[1, :3]) * camera.height / 2
    size = np.array([camera.width, camera.height])
    pixel = np.clip(np.rint(((clip[:, :2] / depth[:, None] + 1) * size - 1) / 2), 0, size - 1).astype(
        np.int64
    )
    return inside, focal / depth, pixel[:, 1], pixel[:, 0]
