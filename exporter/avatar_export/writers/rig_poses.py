"""Poses of a rig: those in which the mesh of engines is measured, and others to which its few joints are fitted."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from avatar_runtime.avatar import F64, Avatar, Rig
from avatar_runtime.clips import frame_pose
from avatar_runtime.engine_pose import rests_bound
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.stages.joints import chain

POSES = 12  # random poses that are measured
MOST_ANGLE = np.radians(40)
MOST_WEIGHT = 3.0  # ranges of expressions are clamped to +- this
CLIP_FRAMES, ALL_CLIP_FRAMES = 8, 64  # of one clip, of all of them
MEASURED, FITTED = 0, 1  # seeds: a fit is never measured in its own random poses
FITTED_RANDOM = 60  # random poses to which the few joints of a vertex are fitted; fewer fit by chance
FITTED_FRAMES = 20  # and frames of all clips
FURTHEST = 1e4  # metres; larger poses are not of a face, and their squares exceed the precision of the fit


def residual_poses(avatar: Avatar) -> Iterator[Pose]:
    """The poses that are measured: random ones, always the same, then evenly spaced frames of the clips.

    Random poses have all weights in their range and all joints rotated by up to 40 degrees.

    The joints of a rig that does not rest in its binding pose push and stretch a face; random rotations of them mean
    nothing. For such a rig the rest pose replaces the random poses.
    """
    if avatar.rig is not None and not rests_bound(avatar.rig):
        yield Pose()
    else:
        yield from _random_poses(avatar, MEASURED, POSES)
    for clip in avatar.clips:
        most = min(CLIP_FRAMES, max(1, ALL_CLIP_FRAMES // len(avatar.clips)))
        for k in np.unique(np.linspace(0, clip.frames - 1, most).astype(np.int64)):
            yield replace(frame_pose(avatar, clip, int(k)), world_from_avatar=np.eye(4))


@np.errstate(over="ignore", invalid="ignore")
def fitted_poses(avatar: Avatar, rig: Rig) -> F64 | None:
    """[P, J, 4, 4] skin matrices of the poses to which few joints are fitted; None if one is beyond FURTHEST.

    Other random poses than those that are measured, or the rest of a rig that does not rest in its binding pose; then
    evenly spaced frames of the clips.
    """
    first = _random_poses(avatar, FITTED, FITTED_RANDOM) if rests_bound(rig) else (Pose(),)
    found = []
    for pose in first:
        arrays = resolve(pose, avatar)
        found.append(chain(rig, arrays.expression_weights[None], arrays.joint_delta[None])[0])
    for clip in avatar.clips:
        share = max(1, FITTED_FRAMES // len(avatar.clips))
        at = np.unique(((np.arange(share) + 0.5) * clip.frames / share).astype(np.int64))
        found.append(chain(rig, clip.expression_weights[at], clip.joint_delta[at].astype(np.float64))[0])
    matrices = np.concatenate(found)
    return matrices if np.abs(matrices).max(initial=0) <= FURTHEST else None


def _random_poses(avatar: Avatar, seed: int, count: int) -> Iterator[Pose]:
    joints = avatar.rig.joint_names if avatar.rig else ()
    rng = np.random.default_rng(seed)
    ranges = np.clip([sorted(e.range) for e in avatar.expressions], -MOST_WEIGHT, MOST_WEIGHT).reshape(-1, 2)
    for _ in range(count):
        weights = rng.uniform(ranges[:, 0], ranges[:, 1])
        axes = rng.standard_normal((len(joints), 3))
        axes /= np.linalg.norm(axes, axis=1, keepdims=True)
        turns = axes * rng.uniform(0, MOST_ANGLE, (len(joints), 1))
        late = rng.uniform(0, 1, len(avatar.eyelids))
        yield Pose(
            dict(zip(avatar.expression_names, weights.tolist(), strict=True)),
            {name: joint_rotation(turn) for name, turn in zip(joints, turns, strict=True)},
            dict(zip(avatar.eyelids, late.tolist(), strict=True)),
        )
