"""Avatars and poses that rig clients are asked about."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import numpy.typing as npt

from avatar_export.writers.rig_glb import rig_glb
from avatar_runtime.avatar import Avatar, Clip, Driving, Rig
from avatar_runtime.checks.avatar import check_avatar
from avatar_runtime.pose import Pose
from avatar_runtime.rotation import homogeneous, matrix_from_rotvec
from tests.oracles.gltf_pose import File

POSES, FRAMES, FPS = 6, 5, 24.0
MOST_ANGLE = np.radians(40)
WEIGHTS = (-0.3, 1.2)


@dataclass(frozen=True)
class RigFile:
    """A rig.glb on disk, the avatar that it is of, and the oracle's view of it."""

    avatar: Avatar
    influences: int
    path: Path
    file: File

    @property
    def rig(self) -> Rig:
        assert self.avatar.rig is not None
        return self.avatar.rig

    @property
    def height(self) -> float:
        """Of the mesh at rest, metres."""
        return float(np.ptp(self.rig.vertices[:, 1]))


def rig_file(avatar: Avatar, influences: int, folder: Path) -> RigFile:
    """`avatar` with a clip more, as rig.glb."""
    avatar = replace(avatar, clips=(*avatar.clips, random_clip(avatar)))
    pieces = rig_glb(avatar, influences)
    assert pieces is not None
    data = b"".join(pieces)
    path = folder / "rig.glb"
    path.write_bytes(data)
    return RigFile(avatar, influences, path, File(data))


def with_odd_names(avatar: Avatar) -> Avatar:
    """`full_avatar` whose joints have names that three.js strips for its animation paths."""
    assert avatar.rig is not None
    names = ("hips:x", "neck.L", "jaw bone", "left[eye]/é", "right eye ")
    renamed = dict(zip(avatar.rig.joint_names, names, strict=True))
    groups = tuple(
        replace(group, joint_mix={renamed[joint]: factor for joint, factor in group.joint_mix.items()})
        for group in avatar.groups
    )
    rules = replace(avatar.rules, rotation_joint=renamed.get(avatar.rules.rotation_joint or ""))
    rig = replace(avatar.rig, joint_names=names)
    return check_avatar(replace(avatar, rig=rig, groups=groups, rules=rules, driving=Driving()))


def random_clip(avatar: Avatar) -> Clip:
    """Weights beyond 0..1, every joint and the whole avatar moved, a new pose each frame."""
    rng = np.random.default_rng(11)
    joints = len(avatar.rig.joint_names) if avatar.rig else 0
    return Clip(
        "random",
        FPS,
        rng.uniform(*WEIGHTS, (FRAMES, len(avatar.expressions))).astype(np.float32),
        rng.uniform(*WEIGHTS, (FRAMES, len(avatar.eyelids))).astype(np.float32),
        homogeneous(_turns(rng, FRAMES, joints)).astype(np.float32),
        homogeneous(_turns(rng, FRAMES), rng.normal(0, 0.2, (FRAMES, 3))).astype(np.float32),
    )


def random_poses(avatar: Avatar) -> Iterator[Pose]:
    """The same each time: weights in WEIGHTS, joints turned by up to MOST_ANGLE, the whole avatar moved."""
    rng = np.random.default_rng(7)
    names = avatar.rig.joint_names if avatar.rig else ()
    for _ in range(POSES):
        weights = rng.uniform(*WEIGHTS, len(avatar.expressions)).tolist()
        late = rng.uniform(*WEIGHTS, len(avatar.eyelids)).tolist()
        yield Pose(
            dict(zip(avatar.expression_names, weights, strict=True)),
            dict(zip(names, homogeneous(_turns(rng, len(names))), strict=True)),
            dict(zip(avatar.eyelids, late, strict=True)),
            homogeneous(_turns(rng), rng.normal(0, 0.2, 3)),
        )


def clip_frames(clip: Clip) -> list[int]:
    """The first and the last frame, and some between them at even distances."""
    frames: list[int] = np.unique(np.linspace(0, clip.frames - 1, FRAMES).round().astype(int)).tolist()
    return frames


def clip_poses(avatar: Avatar, clip: Clip) -> Iterator[Pose]:
    """Those frames of a clip."""
    assert avatar.rig is not None
    for k in clip_frames(clip):
        yield Pose(
            dict(zip(avatar.expression_names, clip.expression_weights[k].tolist(), strict=True)),
            dict(zip(avatar.rig.joint_names, clip.joint_delta[k].astype(np.float64), strict=True)),
            dict(zip(avatar.eyelids, clip.late_weights[k].tolist(), strict=True)),
            clip.world_from_avatar[k].astype(np.float64),
        )


def _turns(rng: np.random.Generator, *shape: int) -> npt.NDArray[np.float64]:
    """Rotation matrices [*shape, 3, 3] about random axes by up to MOST_ANGLE."""
    axis = rng.standard_normal((*shape, 3))
    axis /= np.linalg.norm(axis, axis=-1, keepdims=True)
    turns: npt.NDArray[np.float64] = matrix_from_rotvec(axis * rng.uniform(0, MOST_ANGLE, (*shape, 1)))
    return turns
