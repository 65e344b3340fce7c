"""Clips and poses: from poses to the arrays of a clip and back, and the bare avatar that poses a mesh."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from avatar_export.sparse import no_deltas
from avatar_runtime.avatar import Avatar, Clip, Expression, Gaussians, Rig, Rules, SparseRows
from avatar_runtime.clips import frame_pose
from avatar_runtime.pose import Pose, resolve


def clip_from_poses(avatar: Avatar, name: str, fps: float, poses: Sequence[Pose]) -> Clip:
    """A clip of `poses` at `fps` frames per second; its arrays are in the order of the avatar's names.

    Raises AvatarError for a name that the avatar lacks, ValueError without poses or unless fps is positive.
    """
    if not poses or not (math.isfinite(fps) and fps > 0):
        raise ValueError(f"a clip needs poses and a positive rate, not {len(poses)} poses at {fps} fps")
    arrays = [resolve(pose, avatar) for pose in poses]
    return Clip(
        name,
        float(fps),
        np.stack([a.expression_weights for a in arrays]),
        np.stack([a.late_weights for a in arrays]),
        np.stack([a.joint_delta for a in arrays]).astype(np.float32),
        np.stack([a.world_from_avatar for a in arrays]).astype(np.float32),
    )


def clip_poses(avatar: Avatar, clip: Clip) -> list[Pose]:
    """The pose of every frame of one of the avatar's clips."""
    return [frame_pose(avatar, clip, frame) for frame in range(clip.frames)]


def first_frame(clip: Clip) -> Clip:
    """A clip of the first frame of `clip`."""
    return replace(
        clip,
        expression_weights=clip.expression_weights[:1],
        late_weights=clip.late_weights[:1],
        joint_delta=clip.joint_delta[:1],
        world_from_avatar=clip.world_from_avatar[:1],
    )


def rig_avatar(rig: Rig, expressions: tuple[Expression, ...]) -> Avatar:
    """An avatar of a rig without Gaussians, to pose its mesh; it does not pass the check of avatars."""
    return Avatar(
        name="rig",
        gaussians=Gaussians(*(np.zeros((0, *shape), np.float32) for shape in ((3,), (3,), (4,), (), (1, 3)))),
        groups=(),
        rules=Rules(),
        expressions=expressions,
        eyelids=(),
        blendshapes=no_deltas(0, len(expressions), 9 * len(rig.corrective_joints)),
        skin=SparseRows.empty(0, rig.joint_count, {"weight": ()}),
        rig=rig,
        sh_degree=0,
    )
