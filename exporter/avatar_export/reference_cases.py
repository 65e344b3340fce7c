"""Which poses and cameras the reference of a bundle holds, from the avatar alone."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import numpy.typing as npt

from avatar_export.pictures import Box, frame_camera, robust_box
from avatar_runtime.avatar import Avatar
from avatar_runtime.conformance import Case
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, clip_pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from avatar_runtime.subset import subset

SIZE = 256  # pixels, of a picture
FRAMED = 2048  # Gaussians that a camera is set by
GOLDEN = (np.sqrt(5) - 1) / 2  # its multiples modulo 1 are all different and evenly spread
LARGEST_WEIGHT = 3.0  # ranges of expressions are cut to +- this
MOST_TURN = np.radians(9.0)  # of a joint
WORLD_TURN = (0.15, 0.6, -0.1)  # rotation vector, radians
WORLD_MOVE = (0.04, -0.03, 0.06)  # metres
FRONT = (0.0, 0.0)  # yaw, pitch of the camera, radians
ASIDE = (0.35, 0.2)
CASES = ("rest", "posed", "clip")


def reference_cases(avatar: Avatar) -> tuple[Case, ...]:
    """Those of CASES that `avatar` can show: at rest, with every input that it has, amid its first clip."""
    return tuple(
        Case(name, why, pose, frame_camera(seen(avatar, pose), SIZE, SIZE, *view))
        for name, why, pose, view in _poses(avatar)
    )


def _poses(avatar: Avatar) -> Iterator[tuple[str, str, Pose, tuple[float, float]]]:
    yield "rest", "nothing is posed: files, camera, SH from the front, raster", Pose(), FRONT
    why = "every expression, joint and late morph that there is, the whole turned and moved: SH follow"
    yield "posed", why, every_input(avatar), ASIDE
    if avatar.clips:
        clip = avatar.clips[0]
        frame = clip.frames // 2
        yield "clip", f"frame {frame} of clip {clip.name!r}", clip_pose(avatar, clip, frame), ASIDE


def every_input(avatar: Avatar) -> Pose:
    """A pose in which no weight is 0, no two are equal and every joint turns about an axis of its own.

    Weights lie in their ranges, the more of them the smaller, so that the avatar stays recognisable.
    """
    expressions, late = avatar.expressions, avatar.late_morph_names
    ends = np.clip([e.range[1] or e.range[0] for e in expressions], -LARGEST_WEIGHT, LARGEST_WEIGHT)
    weights = ends * _spread(len(expressions)) * min(1.0, 4.0 / np.sqrt(max(1, len(expressions))))
    joints = avatar.rig.joint_names if avatar.rig else ()
    turn = MOST_TURN * np.stack([_spread(len(joints), k) - 0.6 for k in range(3)], axis=-1)
    return Pose(
        dict(zip(avatar.expression_names, weights.tolist(), strict=True)),
        dict(zip(joints, homogeneous(matrix_from_rotvec(turn)), strict=True)),
        dict(zip(late, _spread(len(late)).tolist(), strict=True)),
        homogeneous(matrix_from_rotvec(np.array(WORLD_TURN)), np.array(WORLD_MOVE)),
    )


def seen(avatar: Avatar, pose: Pose) -> Box:
    """Where the Gaussians are in `pose`, by an even choice of them: the box a camera is set by."""
    count = avatar.gaussians.count
    rows = np.unique(np.linspace(0, count - 1, min(count, FRAMED)).astype(np.int64))
    few = subset(avatar, rows, np.arange(0)) if avatar.rig is None else subset(avatar, rows, _anchors(avatar))
    return robust_box(Player(few.avatar, "reference").animate(pose).mean)


def _anchors(avatar: Avatar) -> npt.NDArray[np.uint32]:
    assert avatar.rig is not None
    return avatar.rig.anchor_vertices


def _spread(count: int, offset: int = 0) -> npt.NDArray[np.float64]:
    """`count` different numbers in 0.1..1."""
    part: npt.NDArray[np.float64] = (np.arange(count) + 1 + 0.3 * offset) * GOLDEN * (1 + offset) % 1
    return 0.1 + 0.9 * part
