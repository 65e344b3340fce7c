"""The pose of a clip at a time: exact in its frames, interpolated between them as all players do."""

from __future__ import annotations

import numpy as np

from avatar_runtime.avatar import F32, F64, Avatar, Clip
from avatar_runtime.checks import arguments
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import matrix_from_quat, quat_from_matrix

AT_FRAME = 1e-6  # of a frame: nearer times are that frame


def clip_pose(avatar: Avatar, clip: Clip, seconds: float) -> Pose:
    """The pose of `clip`, a clip of `avatar`, at a time from 0 to `clip.seconds`; times beyond are those of the ends.

    Frames are exact. Between two frames weights are linear. A matrix is split into a rotation and what remains (Gram-
    Schmidt: scale and shear); quaternions are mixed and normalised, the remainder and the translation are linear.
    Raises TypeError for arguments of other types, ValueError for a time that is not finite and for another avatar's
    clip.
    """
    check_clip_of(avatar, clip)
    place = min(max(arguments.finite("seconds", seconds) * clip.fps, 0), clip.frames - 1)
    nearest = round(place)
    if abs(place - nearest) < AT_FRAME:
        return frame_pose(avatar, clip, nearest)
    first = int(place)
    part = place - first

    def mixed(rows: F32) -> F64:
        result: F64 = (1 - part) * rows[first].astype(np.float64) + part * rows[first + 1]
        return result

    def mixed_matrices(rows: F32) -> F64:
        return _between(rows[first].astype(np.float64), rows[first + 1].astype(np.float64), part)

    return _named(
        avatar,
        mixed(clip.expression_weights),
        mixed(clip.late_weights),
        mixed_matrices(clip.joint_delta),
        mixed_matrices(clip.world_from_avatar),
    )


def frame_pose(avatar: Avatar, clip: Clip, frame: int) -> Pose:
    """Frame `frame` (0 to T - 1) of `clip`. Raises as `clip_pose`, and ValueError for a frame beyond the ends."""
    check_clip_of(avatar, clip)
    frame = arguments.whole("frame", frame, 0, clip.frames - 1)
    return _named(
        avatar,
        clip.expression_weights[frame],
        clip.late_weights[frame],
        clip.joint_delta[frame].astype(np.float64),
        clip.world_from_avatar[frame].astype(np.float64),
    )


def check_clip_of(avatar: Avatar, clip: Clip) -> None:
    """Raise TypeError for arguments of other types, ValueError for a clip with other inputs than the avatar has."""
    arguments.instance("avatar", avatar, Avatar)
    arguments.instance("clip", clip, Clip)
    found = (clip.expression_weights.shape[1], clip.late_weights.shape[1], clip.joint_delta.shape[1])
    own = (len(avatar.expressions), len(avatar.eyelids), avatar.rig.joint_count if avatar.rig else 0)
    if found != own:
        raise ValueError(
            f"clip {clip.name!r} has {found[0]} expressions, {found[1]} eyelids and {found[2]} joints, the avatar "
            f"{own[0]}, {own[1]} and {own[2]}: it is another avatar's clip"
        )


def _named(avatar: Avatar, expressions: F32 | F64, late: F32 | F64, joint_delta: F64, world: F64) -> Pose:
    joints = avatar.rig.joint_names if avatar.rig else ()
    return Pose(
        dict(zip(avatar.expression_names, expressions.tolist(), strict=True)),
        dict(zip(joints, joint_delta, strict=True)),
        dict(zip(avatar.eyelids, late.tolist(), strict=True)),
        world,
    )


# A scale of 0 has no rotation: `resolve` refuses what is not finite.
@np.errstate(divide="ignore", invalid="ignore")
def _between(first: F64, second: F64, part: float) -> F64:
    """Affine matrices [..., 4, 4] of which `part` is `second`; equal ones give their own numbers."""
    turns = _rotation(first), _rotation(second)
    rests = [
        np.swapaxes(turn, -1, -2) @ m[..., :3, :3] for turn, m in zip(turns, (first, second), strict=True)
    ]
    a, b = (quat_from_matrix(turn) for turn in turns)
    short = np.where(np.sum(a * b, axis=-1, keepdims=True) < 0, -part, part)  # the short way round
    quat = (1 - part) * a + short * b
    quat /= np.linalg.norm(quat, axis=-1, keepdims=True)
    mixed = (1 - part) * first + part * second
    mixed[..., :3, :3] = matrix_from_quat(quat) @ ((1 - part) * rests[0] + part * rests[1])
    result: F64 = np.where((first == second).all(axis=(-2, -1), keepdims=True), first, mixed)
    return result


def _rotation(matrices: F64) -> F64:
    """The rotation of [..., 4, 4] by Gram-Schmidt on the columns; of a mirror, too, it is a rotation."""
    x, y = matrices[..., :3, 0], matrices[..., :3, 1]
    u = x / np.linalg.norm(x, axis=-1, keepdims=True)
    across = y - np.sum(u * y, axis=-1, keepdims=True) * u
    v = across / np.linalg.norm(across, axis=-1, keepdims=True)
    return np.stack([u, v, np.cross(u, v)], axis=-1)
