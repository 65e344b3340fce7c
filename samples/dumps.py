"""Posed dumps of a bundle, as another code would write them: `python -m samples.dumps BUNDLE OUT`.

Nothing of the avatar's structure is in them: only posed Gaussians, and the joints and weights that posed them.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from avatar_export.distill.drivers import FILE as DRIVERS
from avatar_export.distill.drivers import Drivers, write
from avatar_export.distill.dumps.folder import FRAMES, Encoding, frame_name, write_document
from avatar_export.distill.sh_turn import turned_sh
from avatar_runtime.avatar import F32, Avatar, Clip, Gaussians
from avatar_runtime.bundle import load
from avatar_runtime.clips import frame_pose
from avatar_runtime.codec import ply
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation, resolve
from avatar_runtime.rotation import matrix_from_quat
from avatar_runtime.stages.activate import Splats
from avatar_runtime.stages.joints import chain, rest_transforms
from avatar_schema import constants

SEED = 7
TRAINED = Encoding()  # numbers as they are trained
Change = Callable[[Splats, Pose], Splats]


def clip_poses(avatar: Avatar, name: str) -> list[Pose]:
    """Every frame of a clip of `avatar`."""
    clip: Clip = next(clip for clip in avatar.clips if clip.name == name)
    return [frame_pose(avatar, clip, frame) for frame in range(clip.frames)]


def random_poses(
    avatar: Avatar, count: int, degrees: float, seed: int = SEED, active: int | None = None
) -> list[Pose]:
    """Random weights of some expressions and eyelids, and random turns of every joint but the roots.

    `degrees`: standard deviation of each component of a joint's rotation vector. `active` expressions are not 0, a
    quarter of them by default.
    """
    rng = np.random.default_rng(seed)
    names, eyelids = avatar.expression_names, avatar.eyelids
    active = max(1, len(names) // 4) if active is None else active
    joints = () if avatar.rig is None else avatar.rig.joint_names
    parents = () if avatar.rig is None else avatar.rig.parents
    poses = []
    for _ in range(count):
        chosen = rng.choice(len(names), min(active, len(names)), replace=False) if names else []
        weights = {names[k]: float(rng.uniform(0, 1)) for k in chosen}
        turns = {
            joint: joint_rotation(np.radians(rng.normal(0, degrees, 3)))
            for joint, parent in zip(joints, parents, strict=True)
            if parent >= 0
        }
        poses.append(Pose(weights, turns, {name: float(rng.uniform(0, 1)) for name in eyelids}))
    return poses


def write_dumps(
    avatar: Avatar,
    takes: Sequence[Sequence[Pose]],
    folder: Path,
    encoding: Encoding = TRAINED,
    *,
    change: Change | None = None,
    skeleton: bool = True,
    **document: Any,
) -> Path:
    """Pose `avatar` and write its dumps to `folder`, which is returned; each of `takes` is one take.

    `change` alters the posed Gaussians, as a network would. `document` goes to dumps.json.
    """
    (folder / FRAMES).mkdir(parents=True)
    player = Player(avatar)
    poses = [pose for take in takes for pose in take]
    for index, pose in enumerate(poses):
        splats = player.animate(pose)
        splats = splats if change is None else change(splats, pose)
        trained = _in_training_units(encoded(splats, encoding), avatar.training_per_bundle, encoding)
        (folder / FRAMES / frame_name(index)).write_bytes(ply.encode(trained))
    take = np.concatenate([np.full(len(poses), index) for index, poses in enumerate(takes)])
    write(drivers_of(avatar, poses, take, skeleton), folder / DRIVERS, force=False)
    document = {"unit": 1 / avatar.training_per_bundle, **document}
    rights = {
        key: avatar.provenance[key] for key in ("licence", "author", "consent") if avatar.provenance.get(key)
    }
    write_document(folder, avatar.name, encoding, {**rights, **document})
    return folder


def drivers_of(
    avatar: Avatar, poses: Sequence[Pose], take: npt.NDArray[np.int64], skeleton: bool = True
) -> Drivers:
    """What a code would know of its own frames: expressions and eyelids, and the posed joints."""
    arrays = [resolve(pose, avatar) for pose in poses]
    values = np.array([[*pose.expression_weights, *pose.late_weights] for pose in arrays], np.float64)
    names = (*avatar.expression_names, *(f"eyelid_{name}" for name in avatar.eyelids))
    values = values.reshape(len(poses), -1)
    if avatar.rig is None or not skeleton:
        none = np.zeros((0, 4, 4))
        return Drivers((), np.zeros(0, np.int64), none, np.zeros((len(poses), 0, 4, 4)), names, values, take)
    weights = np.stack([pose.expression_weights for pose in arrays])
    posed = chain(avatar.rig, weights, np.stack([pose.joint_delta for pose in arrays]))[2]
    world = np.stack([pose.world_from_avatar for pose in arrays])
    rest, moved = rest_transforms(avatar.rig).astype(np.float64), world[:, None] @ posed
    for matrices in (rest, moved):
        matrices[..., :3, 3] *= avatar.training_per_bundle
        matrices[..., 3, :] = (0, 0, 0, 1)
    parents = avatar.rig.parents.astype(np.int64)
    return Drivers(avatar.rig.joint_names, parents, rest, moved, names, values, take)


def _in_training_units(g: Gaussians, units: float, encoding: Encoding) -> Gaussians:
    larger = np.float32(units)
    scale = g.log_scale + np.log(larger) if encoding.scale == "log" else g.log_scale * larger
    return replace(g, mean=g.mean * larger, log_scale=scale)


def encoded(splats: Splats, encoding: Encoding) -> Gaussians:
    """Posed splats as a code stores them."""
    quat = splats.quat_wxyz if encoding.quaternion == "wxyz" else splats.quat_wxyz[:, [1, 2, 3, 0]]
    opacity = np.clip(splats.opacity.astype(np.float64), 1e-7, 1 - 1e-7)
    sh = splats.sh
    if encoding.sh == "rotated" and splats.sh_rotation is not None:
        sh = turned_sh(sh, splats.sh_rotation)
    if encoding.colour == "rgb":
        sh = sh.copy()
        sh[:, 0] = sh[:, 0] * np.float32(constants()["sh_c0"][0]) + np.float32(0.5)
    return Gaussians(
        splats.mean,
        np.log(splats.scale) if encoding.scale == "log" else splats.scale,
        quat,
        (np.log(opacity / (1 - opacity)) if encoding.opacity == "logit" else opacity).astype(np.float32),
        sh,
    )


def covariances(splats: Splats) -> F32:
    """[N, 6] xx xy xz yy yz zz."""
    axes = matrix_from_quat(splats.quat_wxyz.astype(np.float64))
    full = np.einsum("nij,nj,nkj->nik", axes, splats.scale.astype(np.float64) ** 2, axes)
    result: F32 = full.reshape(-1, 9)[:, [0, 1, 2, 4, 5, 8]].astype(np.float32)
    return result


def main() -> None:
    """Dump the clips and as many random poses of a bundle."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("bundle", type=Path)
    parser.add_argument("out", type=Path, help="folder to make")
    parser.add_argument("--every", type=int, default=3, help="take every N-th frame of the clips")
    parser.add_argument("--random", type=int, default=120, help="random poses")
    given = parser.parse_args()
    avatar = load(given.bundle)
    takes = [clip_poses(avatar, clip.name)[:: given.every] for clip in avatar.clips]
    names = [clip.name for clip in avatar.clips]
    if given.random:
        takes += [
            random_poses(avatar, given.random, 8.0),
            random_poses(avatar, given.random // 4, 8.0, SEED + 1),
        ]
        names += ["random", "random_held_out"]
    write_dumps(avatar, takes, given.out, take_names=names)
    print(f"{given.out}: {sum(map(len, takes))} frames in {len(takes)} takes")


if __name__ == "__main__":
    main()
