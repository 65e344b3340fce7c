"""Boxes that a renderer may cull by: at rest, and swept over everything a pose may do."""

from __future__ import annotations

from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, SparseRows
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.joints import joints
from avatar_runtime.stages.skin import transform
from avatar_runtime.stages.sparse import gather

JOINT_SWEEP = np.radians(30.0)  # each joint that carries Gaussians, about each axis, to either side
SIGMAS = 3.0


def bounds(avatar: Avatar) -> dict[str, Any]:
    """{"rest", "swept"}: {"min", "max"} in mesh space, metres, three standard deviations included.

    Swept is conservative: expressions by interval arithmetic over their ranges (any combination), joints one
    at a time.
    """
    g = avatar.gaussians
    reach = _reach(g.log_scale, g.quat_wxyz)
    rest = _box(g.mean - reach, g.mean + reach)
    low, high = _interval(avatar.blendshapes.geometry, avatar)
    grown = reach * np.exp(_largest_growth(avatar))[:, None]
    centre = g.mean + (low + high) / 2
    half = (high - low) / 2 + grown
    boxes = [_box(centre - half, centre + half)]
    # A box of half-size h turned by a rotation fits a box of half-size |R| h <= sqrt(3) max(h).
    radius = np.linalg.norm(half, axis=1, keepdims=True)
    for posed in _joint_poses(avatar, centre):
        boxes.append(_box(posed - radius, posed + radius))
    swept = _box(np.array([b["min"] for b in boxes]), np.array([b["max"] for b in boxes]))
    return {"rest": rest, "swept": swept}


def _reach(log_scale: F32, quat_wxyz: F32) -> F64:
    """Half-size of each Gaussian's axis-aligned box at `SIGMAS` standard deviations, [N, 3]."""
    unit = quat_wxyz / np.maximum(np.linalg.norm(quat_wxyz, axis=1, keepdims=True), 1e-12)
    axes = matrix_from_quat(unit) * np.exp(log_scale)[:, None, :]
    result: F64 = SIGMAS * np.sqrt(np.sum(axes.astype(np.float64) ** 2, axis=2))
    return result


def _interval(geometry: SparseRows, avatar: Avatar) -> tuple[F64, F64]:
    """[N, 3] least and largest displacement over all weights in range."""
    ranges = np.array([e.range for e in avatar.expressions], np.float64).reshape(-1, 2)
    at = ranges[geometry.column]
    a, b = geometry.values["mean"] * at[:, :1], geometry.values["mean"] * at[:, 1:]
    return _row_sums(geometry, np.minimum(a, b)), _row_sums(geometry, np.maximum(a, b))


def _largest_growth(avatar: Avatar) -> F64:
    """[N] most that expressions can add to the largest log scale."""
    appearance = avatar.blendshapes.appearance
    ranges = np.array([e.range for e in avatar.expressions], np.float64).reshape(-1, 2)
    at = ranges[appearance.column]
    delta = appearance.values["log_scale"].astype(np.float64)
    most = np.maximum((delta * at[:, :1]).max(axis=1, initial=0), (delta * at[:, 1:]).max(axis=1, initial=0))
    return _row_sums(appearance, most[:, None])[:, 0]


def _joint_poses(avatar: Avatar, mean: F64) -> list[F64]:
    if avatar.rig is None or not avatar.skin.entries:
        return []
    poses = []
    used = np.unique(avatar.skin.column)
    rows = np.unique(
        np.repeat(np.arange(len(mean)), avatar.skin.row_ptr[1:].astype(np.int64) - avatar.skin.row_ptr[:-1])
    )
    for joint in used:
        for axis in np.concatenate([np.eye(3), -np.eye(3)]):
            name = avatar.rig.joint_names[joint]
            pose = Pose(joints={name: joint_rotation(axis * JOINT_SWEEP)})
            state = joints(avatar.rig, resolve(pose, avatar))
            posed = mean.copy()
            posed[rows] = transform(gather(avatar.skin, state.skin_matrix[:, :3]), mean.astype(np.float32))[
                rows
            ]
            poses.append(posed)
    return poses


def _row_sums(sparse: SparseRows, values: F64) -> F64:
    sums = np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0, dtype=np.float64)])
    result: F64 = sums[sparse.row_ptr[1:]] - sums[sparse.row_ptr[:-1]]
    return result


def _box(low: Any, high: Any) -> dict[str, list[float]]:
    return {
        "min": [float(np.float32(v)) for v in low.reshape(-1, 3).min(axis=0)],
        "max": [float(np.float32(v)) for v in high.reshape(-1, 3).max(axis=0)],
    }
