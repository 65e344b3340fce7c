"""What an avatar does when joints turn that never moved in its dumps: `python -m bench.distill untaught`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from samples.dumps import clip_poses, random_poses, write_dumps

from avatar_export.distill.make import Distilled, distill
from avatar_runtime.avatar import Avatar
from avatar_runtime.player import Player
from avatar_runtime.pose import Pose, joint_rotation
from avatar_trainer.evaluation.stability import SLACK, Stretch
from bench.distill import boxes

DEGREES = 8.0  # of random turns in the dumps
FAR = 30.0  # of the untaught joints


@dataclass(frozen=True)
class Held:
    """How an avatar holds up that was learnt from dumps in which some joints never moved."""

    alone: tuple[
        float, float
    ]  # torn shares where only those joints turn: the original's, the learnt avatar's
    mixed: tuple[float, float]  # the same where all joints turn
    result: Distilled
    taught: float  # mm RMS from the original in a held-out clip without those joints


def still(poses: Sequence[Pose], joints: Sequence[str], degrees: float) -> list[Pose]:
    """`poses` in which `joints` stand turned by `degrees` from rest."""
    stand = dict.fromkeys(joints, joint_rotation(np.radians([0.0, 0.0, degrees])))
    return [replace(pose, joints={**pose.joints, **stand}) for pose in poses]


def held(
    avatar: Avatar,
    joints: Sequence[str],
    folder: Path,
    most: int = 120,
    with_rig: bool = False,
    degrees: float = 0.0,
) -> Held:
    """Learn `avatar` from dumps in which `joints` stand turned by `degrees` from rest, then turn them."""
    shown = still(boxes.spread(clip_poses(avatar, "training"), most), joints, degrees)
    shown += still(random_poses(avatar, most // 2, DEGREES), joints, degrees)
    rest = still(random_poses(avatar, most // 4, DEGREES, seed=8), joints, degrees)
    write_dumps(avatar, [shown, rest], folder)
    result = distill(folder, rig=avatar.rig if with_rig else None, accept_error=True)
    random = random_poses(avatar, 12, FAR, seed=9)
    alone = [Pose(joints={name: pose.joints[name] for name in joints}) for pose in random]
    both = avatar, result.avatar
    clip = still(clip_poses(avatar, "held_out"), joints, degrees)
    off = [
        np.square(a - b).sum(axis=1).mean()
        for a, b in zip(*(_places(one, clip) for one in both), strict=True)
    ]
    return Held(
        tuple(torn(one, shown, alone) for one in both),
        tuple(torn(one, shown, clip_poses(avatar, "held_out") + random) for one in both),
        result,
        1e3 * float(np.sqrt(np.mean(off))),
    )


def torn(avatar: Avatar, shown: Sequence[Pose], poses: Sequence[Pose]) -> float:
    """Opacity-weighted share of (splat, frame) that is stretched more than in the poses `shown`."""
    player = Player(avatar)
    stretch = Stretch(avatar, player)
    limit = SLACK * np.max([stretch.of(place) for place in _places(avatar, shown)], axis=0)
    opacity = 1 / (1 + np.exp(-avatar.gaussians.opacity_logit.astype(np.float64)))
    over = np.mean([stretch.of(place) > limit for place in _places(avatar, poses)], axis=0)
    return float((opacity * over).sum() / opacity.sum())


def _places(avatar: Avatar, poses: Sequence[Pose]) -> list[np.ndarray]:
    """[N, 3] in each pose of the original."""
    player = Player(avatar)
    drivers = set(avatar.expression_names)
    found = []
    for pose in poses:
        eyelids = {f"eyelid_{name}": weight for name, weight in pose.eyelids.items()}
        if eyelids.keys() <= drivers:
            pose = replace(pose, expressions={**pose.expressions, **eyelids}, eyelids={})
        found.append(player.animate(pose).mean)
    return found


def untaught() -> None:
    """Print the figures of the trained samples."""
    body = boxes.body_splatting()
    arm, knee = ("Skeleton_arm_joint_L__3_", "Skeleton_arm_joint_L__2_"), ("leg_joint_R_2",)
    for name, avatar, joints, with_rig in (
        ("head_blendshapes", boxes.head_blendshapes(), ("neck", "rightEye"), False),
        ("head_splatting", boxes.head_splatting(), ("neck", "rightEye"), False),
        ("body", body, (*arm, *knee), False),
        ("body, with its mesh", body, (*arm, *knee), True),
    ):
        with TemporaryDirectory() as folder:
            found = held(avatar, joints, Path(folder) / "dumps", with_rig=with_rig)
        print(f"untaught joints, {name}: {', '.join(joints)}")
        for what, pair in (("they alone turn", found.alone), ("all joints turn", found.mixed)):
            print(f"  torn share, {what}: original {100 * pair[0]:.3f} %, learnt {100 * pair[1]:.3f} %")
        print(f"  held-out clip of the others: {found.taught:.3f} mm RMS from the original", flush=True)
