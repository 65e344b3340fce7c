"""The poses and cameras from which contributions are measured and to which levels are fitted."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from avatar_export.images import Box, frame_camera, robust_box
from avatar_export.levels.compositing import ALPHA_MIN, Flat
from avatar_runtime.avatar import Avatar
from avatar_runtime.camera import Camera
from avatar_runtime.clips import frame_pose
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.project import project
from avatar_runtime.stages.sort import sort

SIZE = 512  # pixels along the edge of an image
POSES = 24
LEVEL_POSES = 72  # for a level: what few poses show, such as teeth, is merged and fitted in those
CLIP_SHARE = 0.5  # of the poses, where the avatar has clips
EXPRESSIONS_AT_ONCE = 6  # in a pose made of ranges
JOINT_TURN = 0.15  # radians, standard deviation in a pose made of ranges
FRONT_SHARE = 0.8  # of the views, within FRONT of the front; the others lie all around
FRONT = np.radians(70.0)
PITCH = np.radians(20.0)
SEED = 7
GOLDEN = (np.sqrt(5) - 1) / 2
SILVER = np.sqrt(2) - 1


@dataclass(frozen=True)
class View:
    """A pose seen by a camera."""

    pose: Pose
    camera: Camera


def views(
    avatar: Avatar, count: int, sizes: tuple[int, ...] = (SIZE,), poses_count: int = POSES
) -> list[View]:
    """`count` views: all poses and `sizes` (pixels) in turn, cameras spread evenly. The same ones every time."""
    poses = fitting_poses(avatar, poses_count)
    box = posed_box(avatar, poses[:: max(1, len(poses) // 6)])
    result = []
    for index in range(count):
        across, up = (index * GOLDEN + 0.25) % 1, (index * SILVER + 0.5) % 1
        if across < FRONT_SHARE:
            yaw = (2 * across / FRONT_SHARE - 1) * FRONT
        else:
            yaw = FRONT + (across - FRONT_SHARE) / (1 - FRONT_SHARE) * 2 * (np.pi - FRONT)
        pose = poses[(index * 7) % len(poses)]
        size = sizes[index % len(sizes)]
        result.append(View(pose, frame_camera(box, size, size, yaw, (2 * up - 1) * PITCH)))
    return result


def fitting_poses(avatar: Avatar, count: int = POSES) -> list[Pose]:
    """`count` poses: at rest, moments of the avatar's clips, random ones within its ranges; none moves in the world."""
    return [Pose(), *some_poses(avatar, count - 1, 0.5, SEED)]


def some_poses(avatar: Avatar, count: int, phase: float, seed: int) -> list[Pose]:
    """Moments of the clips at `phase` of their interval, then random poses within the ranges; `count` in all."""
    rng = np.random.default_rng(seed)
    frames = [(clip, frame) for clip in avatar.clips for frame in range(clip.frames)]
    moments = min(len(frames), round(count * CLIP_SHARE))
    at = ((np.arange(moments) + phase) / max(moments, 1) * len(frames)).astype(int)
    poses = [_still(frame_pose(avatar, *frames[index])) for index in at]
    while len(poses) < count:
        poses.append(_within_ranges(avatar, rng))
    return poses


def expressions_alone(avatar: Avatar) -> list[Pose]:
    """Each expression at the end of its range; at most POSES times two of them, evenly chosen."""
    chosen = avatar.expressions[:: max(1, len(avatar.expressions) // (2 * POSES))]
    return [Pose({e.name: e.range[1]}) for e in chosen]


def _still(pose: Pose) -> Pose:
    return replace(pose, world_from_avatar=np.eye(4))


def _within_ranges(avatar: Avatar, rng: np.random.Generator) -> Pose:
    """A few expressions anywhere in their ranges, eyelids, and small turns of all joints but the roots."""
    names = avatar.expressions
    used = rng.permutation(len(names))[:EXPRESSIONS_AT_ONCE]
    weights = {names[k].name: float(rng.uniform(*sorted(names[k].range))) for k in used}
    late = {name: float(rng.uniform(0, 0.7)) for name in avatar.eyelids}
    joints = {}
    if avatar.rig is not None:
        for name, parent in zip(avatar.rig.joint_names, avatar.rig.parents, strict=True):
            turn = rng.normal(0, JOINT_TURN, 3)
            if parent >= 0:
                joints[name] = joint_rotation(turn)
    return Pose(weights, joints, late)


def posed_box(avatar: Avatar, poses: list[Pose]) -> Box:
    """The box of the Gaussians in some poses."""
    player = Player(avatar)
    return robust_box(np.concatenate([player.animate(pose).mean for pose in poses]))


def flattened(
    avatar: Avatar, splats: Splats, camera: Camera, stride: int = 1, first: tuple[int, int] = (0, 0)
) -> Flat:
    """The drawn splats, nearest first, as the image of every `stride`-th pixel from pixel `first` (x, y) on."""
    seen = project(splats, camera, avatar.raster, avatar.sh_degree)
    order = sort(seen)
    order = order[seen.opacity[order] > ALPHA_MIN]
    f32 = np.float32
    return Flat(
        order,
        (seen.centre[order] - np.array(first, f32)) / f32(stride),
        seen.conic[order] * f32(stride * stride),
        seen.opacity[order],
        seen.rgb[order],
    )
