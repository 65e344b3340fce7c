"""FLAME's and SMPL's skinning in float64, vertex by vertex, as their papers write it. Shares nothing with the rest."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[Any]


def rodrigues(vector: Array) -> Array:
    """Rotation matrix [3, 3] of a rotation vector."""
    angle = math.sqrt(float(vector @ vector))
    if angle == 0:
        return np.eye(3)
    x, y, z = vector / angle
    cross = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + math.sin(angle) * cross + (1 - math.cos(angle)) * (cross @ cross)


def posed_vertices(
    model: dict[str, Array],
    shape: Array,
    expression: Array,
    pose: Array,  # [J, 3]
    translation: Array,
    static_offset: Array | None = None,
    unseen_by_joints: Array | None = None,  # [V, 3] added to the shape after its joints are taken
) -> Array:
    """Posed vertices [V, 3] of a model with v_template, identity, expression, posedirs, regressor, weights, parents."""
    template = model["v_template"].astype(np.float64)
    if static_offset is not None:
        template = template + static_offset
    shaped = template.copy()
    for s, coefficient in enumerate(shape):
        shaped += coefficient * model["identity"][:, :, s]
    for e, coefficient in enumerate(expression):
        shaped += coefficient * model["expression"][:, :, e]
    joints = model["regressor"].astype(np.float64) @ shaped
    turns = [rodrigues(vector) for vector in pose.astype(np.float64)]
    feature = np.concatenate([(turn - np.eye(3)).reshape(-1) for turn in turns[1:]])
    corrected = shaped + model["posedirs"].astype(np.float64) @ feature
    if unseen_by_joints is not None:
        corrected = corrected + unseen_by_joints
    world: list[Array] = []
    for j, parent in enumerate(model["parents"]):
        local = np.eye(4)
        local[:3, :3] = turns[j]
        local[:3, 3] = joints[j] - (joints[parent] if parent >= 0 else 0)
        world.append(local if parent < 0 else world[parent] @ local)
    result = np.zeros_like(corrected)
    for v, point in enumerate(corrected):
        for j, matrix in enumerate(world):
            moved = matrix[:3, :3] @ (point - joints[j]) + matrix[:3, 3]
            result[v] += float(model["weights"][v, j]) * moved
    return result + translation
