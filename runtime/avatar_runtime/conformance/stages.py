"""One stage alone: stage `joints` is NumPy's for every backend, the others are the backend's."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from avatar_runtime.avatar import F32, Avatar, Rig
from avatar_runtime.backends import Arrays, Stages
from avatar_runtime.camera import Camera
from avatar_runtime.conformance.model import Tensor
from avatar_runtime.pose import PoseArrays
from avatar_runtime.posed import posed_mesh
from avatar_runtime.stages.groups import group_transforms
from avatar_runtime.stages.joints import joints


def run_stage(
    avatar: Avatar,  # the whole: joints and groups are not thinned out
    backend: Stages,  # of its subset
    stage: str,
    profile: str | None,
    inputs: Arrays,
    camera: Camera,
) -> Mapping[str, Tensor]:
    """The outputs that `STAGE_ARRAYS` names; those of raster for every pixel."""
    if stage == "joints":
        return joints_alone(avatar, inputs)
    with np.errstate(over="ignore", invalid="ignore"):
        return backend.stage(stage, inputs, camera, profile or "trainer")


def at_pixels(outputs: Mapping[str, Tensor], pixels: Tensor) -> dict[str, Tensor]:
    """Outputs of raster at the pixels y * width + x."""
    return {name: a.reshape(-1, *a.shape[2:])[pixels] for name, a in outputs.items()}


def posed_anchors(rig: Rig, pose: PoseArrays) -> F32:
    """The posed anchor vertices [A, 3], repeats kept: an input of stage `joints`."""
    return posed_mesh(rig, pose, joints(rig, pose))[rig.anchor_vertices]


def joints_alone(avatar: Avatar, x: Arrays) -> dict[str, Any]:
    """The outputs of stage `joints` for its inputs; the avatar has a rig."""
    assert avatar.rig is not None
    none = np.zeros(0, np.float32)
    state = joints(avatar.rig, PoseArrays(x["expression_weights"], none, x["joint_delta"], np.eye(4)))
    groups = group_transforms(avatar, state, x.get("anchor_vertices"))
    return {
        "skin_matrix": state.skin_matrix,
        "pose_feature": state.pose_feature,
        "group_matrix": groups.matrix,
        "group_rotation": groups.rotation,
    }
