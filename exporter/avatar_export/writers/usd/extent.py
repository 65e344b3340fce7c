"""Boxes around the content of the stage, for culling."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from avatar_export.writers.engine_mesh import EngineMesh
from avatar_export.writers.usd.mesh import influences
from avatar_runtime.avatar import F64, Rig
from avatar_runtime.engine_pose import EnginePose, bind_nodes, node_transforms
from avatar_runtime.rotation import matrix_from_quat

SIGMAS = 3.0  # standard deviations of a splat in a box


def moved(pose: EnginePose, points: F64) -> F64:
    """[T, n, 3]: points [n, 3] or [T, n, 3] under the root node of each frame."""
    turn = matrix_from_quat(np.roll(pose.root_rotation_xyzw, 1, axis=-1))
    result: F64 = points @ np.swapaxes(turn, -1, -2) + pose.root_translation[:, None, :]
    return result


def corners(box: npt.NDArray[np.floating]) -> F64:
    """The corners [8, 3] of a box [2, 3]."""
    pick = (np.arange(8)[:, None] >> np.arange(3)) & 1
    result: F64 = box.astype(np.float64)[pick, np.arange(3)]
    return result


def posed_corners(rig: Rig, mesh: EngineMesh, pose: EnginePose) -> F64:
    """[T, n, 3] corners of boxes that contain the mesh in every frame of `pose`, relative to the root node.

    Each joint moves the box of the vertices that it influences, extended by the blend shapes; a skinned vertex lies
    between its positions by each of its joints.
    """
    low, high = mesh.vertices.astype(np.float64), mesh.vertices.astype(np.float64)
    ranges = zip(pose.weights.min(axis=0), pose.weights.max(axis=0), strict=True)
    for target, (least, most) in zip(mesh.targets, ranges, strict=True):
        low[target.rows] += np.minimum(least * target.offsets, most * target.offsets)
        high[target.rows] += np.maximum(least * target.offsets, most * target.offsets)
    skin_matrix = node_transforms(rig, pose) @ np.linalg.inv(bind_nodes(rig))
    joints, weights = influences(mesh.skin)
    found = []
    for joint in np.unique(joints[weights > 0]):
        rows = ((joints == joint) & (weights > 0)).any(axis=1)
        box = np.stack([low[rows].min(axis=0), high[rows].max(axis=0)])
        turn, shift = skin_matrix[:, joint, :3, :3], skin_matrix[:, joint, None, :3, 3]
        found.append(corners(box) @ np.swapaxes(turn, -1, -2) + shift)
    return np.concatenate(found, axis=1)
